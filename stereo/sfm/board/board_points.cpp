// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/board/board_points.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

namespace polarscan {
namespace {

constexpr double kLeastAngle_deg = 2;
constexpr std::size_t kMostPairs = 200;

// From a camera through a place in its picture, world.
struct SightLine {
  Eigen::Vector3d origin, direction;
};

SightLine LineOf(const BoardCamera& camera, const Eigen::Vector2d& at) {
  const Pinhole& p = camera.lens.pinhole;
  const Eigen::Vector2d n = camera.lens.Undistort({(at.x() - p.cx) / p.fx, (at.y() - p.cy) / p.fy});
  const Eigen::Vector3d ray(n.x(), n.y(), 1);
  return {camera.cam_from_world.Center(), (camera.cam_from_world.rotation.transpose() * ray).normalized()};
}

// The point with the least sum of squared distances to the lines.
Eigen::Vector3d NearestPoint(const std::vector<SightLine>& lines) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const SightLine& line : lines) {
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - line.direction * line.direction.transpose();
    a += across, b += across * line.origin;
  }
  return a.ldlt().solve(b);
}

using PointSightings = std::vector<const BoardObservation*>;

std::vector<std::size_t> Agreeing(const std::vector<BoardCamera>& cameras, const PointSightings& seen,
                                  const Eigen::Vector3d& point, double limit_px) {
  std::vector<std::size_t> agree;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto shown = Shown(cameras[std::size_t(seen[i]->camera)], point);
    if (shown && (*shown - seen[i]->at).norm() < limit_px) agree.push_back(i);
  }
  return agree;
}

std::optional<Eigen::Vector3d> TriangulateOne(const std::vector<BoardCamera>& cameras,
                                              const PointSightings& seen, double limit_px) {
  std::vector<SightLine> lines;
  for (const BoardObservation* o : seen) lines.push_back(LineOf(cameras[std::size_t(o->camera)], o->at));
  const std::size_t pairs = seen.size() * (seen.size() - 1) / 2, step = 1 + pairs / kMostPairs;
  std::vector<std::size_t> best;
  for (std::size_t i = 0, pair = 0; i < seen.size(); ++i)
    for (std::size_t j = i + 1; j < seen.size(); ++j, ++pair) {
      if (pair % step != 0 || AngleDegrees(lines[i].direction, lines[j].direction) < kLeastAngle_deg)
        continue;
      std::vector<std::size_t> agree = Agreeing(cameras, seen, NearestPoint({lines[i], lines[j]}), limit_px);
      if (agree.size() > best.size()) best = std::move(agree);
    }
  if (best.size() < 2) return {};
  std::vector<SightLine> chosen;
  for (const std::size_t i : best) chosen.push_back(lines[i]);
  return NearestPoint(chosen);
}

}  // namespace

std::optional<Eigen::Vector2d> Shown(const BoardCamera& camera, const Eigen::Vector3d& world) {
  const Eigen::Vector3d p = camera.cam_from_world * world;
  if (!(p.z() > 0)) return {};
  const Eigen::Vector2d n = camera.lens.Distort({p.x() / p.z(), p.y() / p.z()});
  const Pinhole& pinhole = camera.lens.pinhole;
  return Eigen::Vector2d(pinhole.fx * n.x() + pinhole.cx, pinhole.fy * n.y() + pinhole.cy);
}

std::map<int, BoardPoint> TriangulateBoard(const std::vector<BoardCamera>& cameras,
                                           const std::vector<BoardObservation>& observations,
                                           double limit_px) {
  std::map<int, PointSightings> by_point;
  for (const BoardObservation& o : observations) by_point[o.point].push_back(&o);
  std::map<int, BoardPoint> points;
  for (const auto& [name, seen] : by_point)
    if (const auto point = TriangulateOne(cameras, seen, limit_px))
      points[name] = {seen[0]->on_board, *point};
  return points;
}

}  // namespace polarscan
