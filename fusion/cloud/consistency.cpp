// SPDX-License-Identifier: Apache-2.0
#include "fusion/cloud/consistency.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

namespace polarscan {
namespace {

constexpr double kGrazing = 0.1;  // cosine below which a plane is no guide to the depth beside its pixel

// z where the ray through (u, v) meets the plane of the pixel it lies in.
double DepthAt(const ViewMaps& view, int x, int y, double u, double v) {
  const double depth = view.depth(x, y);
  const Eigen::Vector3d normal = view.normal(x, y).cast<double>();
  const Eigen::Vector3d centre = view.camera.Ray(x + 0.5, y + 0.5), ray = view.camera.Ray(u, v);
  const double along = normal.dot(ray);
  if (along > -kGrazing * ray.norm()) return depth;
  return depth * normal.dot(centre) / along;
}

Eigen::Vector3d ToWorld(const Rigid& cam_from_world, const Eigen::Vector3d& p) {
  return cam_from_world.rotation.transpose() * (p - cam_from_world.translation);
}

// Asks one view. Counts how it ended.
std::optional<Agreement> Ask(const ViewMaps& reference, const Eigen::Vector2d& pixel,
                             const SurfacePoint& point, const ViewMaps& other,
                             const ConsistencyLimits& limits, ConsistencyCounts& counts) {
  const Eigen::Vector3d seen = other.cam_from_world * point.position;
  const auto none = [](std::size_t& count) { return ++count, std::nullopt; };
  if (seen.z() <= 0) return none(counts.outside);
  const Eigen::Vector2d uv = other.camera.Project(seen);
  if (!other.camera.Contains(uv)) return none(counts.outside);
  const int x = int(uv.x()), y = int(uv.y());
  if (other.depth(x, y) == 0) return none(counts.no_depth);

  const double depth = DepthAt(other, x, y, uv.x(), uv.y());
  const double relative = (depth - seen.z()) / seen.z();
  if (std::abs(relative) > limits.relative_depth) {
    counts.seen_through += relative > 3 * limits.relative_depth;
    return none(counts.depth);
  }
  const Eigen::Vector3d position = ToWorld(other.cam_from_world, depth * other.camera.Ray(uv.x(), uv.y()));
  const double error_px = (reference.camera.Project(reference.cam_from_world * position) - pixel).norm();
  if (error_px > limits.reprojection_px) return none(counts.reprojection);
  const Eigen::Vector3d normal =
      other.cam_from_world.rotation.transpose() * other.normal(x, y).cast<double>();
  const double angle = AngleDegrees(normal, point.normal);
  if (angle > limits.normal_deg) return none(counts.normal);

  ++counts.agreed;
  const double residual = (error_px / limits.reprojection_px + std::abs(relative) / limits.relative_depth +
                           angle / limits.normal_deg) /
                          3;
  return Agreement{0, 0, uv, x, y, position, residual};
}

// Where the ray origin + t direction meets the tangent plane of a view's surface point.
double MeetsPlane(const ViewMaps& view, int x, int y, const Eigen::Vector3d& point,
                  const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d n = view.cam_from_world.rotation.transpose() * view.normal(x, y).cast<double>();
  const double along = n.dot(direction);
  if (along > -kGrazing * direction.norm()) return (point - origin).dot(direction) / direction.squaredNorm();
  return n.dot(point - origin) / along;
}

// Running weighted means of what a cloud point holds.
struct WeightedMean {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(), colour = Eigen::Vector3d::Zero();
  double along_ray = 0, dop = 0, weight = 0;

  void Add(const ViewMaps& view, int x, int y, double place) {
    const Eigen::Vector3d n = view.normal(x, y).cast<double>();
    const double w = std::max(kGrazing, -n.dot(view.camera.Ray(x + 0.5, y + 0.5).normalized()));
    const Rgb8& c = view.colour(x, y);
    along_ray += w * place;
    normal += w * (view.cam_from_world.rotation.transpose() * n);
    colour += w * Eigen::Vector3d(c.r, c.g, c.b);
    dop += w * view.dop(x, y);
    weight += w;
  }
};

std::uint8_t Byte(double value) { return std::uint8_t(std::clamp(std::lround(value), 0l, 255l)); }

}  // namespace

ConsistencyCounts& ConsistencyCounts::operator+=(const ConsistencyCounts& other) {
  agreed += other.agreed;
  outside += other.outside;
  no_depth += other.no_depth;
  depth += other.depth;
  seen_through += other.seen_through;
  reprojection += other.reprojection;
  normal += other.normal;
  return *this;
}

SurfacePoint BackProject(const ViewMaps& view, int x, int y) {
  const Eigen::Vector3d p = double(view.depth(x, y)) * view.camera.Ray(x + 0.5, y + 0.5);
  return {ToWorld(view.cam_from_world, p),
          view.cam_from_world.rotation.transpose() * view.normal(x, y).cast<double>()};
}

double PatchArea(const ViewMaps& view, int x, int y) {
  const Eigen::Vector3d ray = view.camera.Ray(x + 0.5, y + 0.5);
  const double cosine = -view.normal(x, y).cast<double>().dot(ray) / ray.norm();
  const double depth = view.depth(x, y);
  return depth * depth / (view.camera.fx * view.camera.fy * std::max(kGrazing, cosine));
}

void FindAgreements(const ViewMaps& reference, int x, int y,
                    const std::vector<std::shared_ptr<const ViewMaps>>& candidates,
                    const std::vector<int>& places, const ConsistencyLimits& limits,
                    std::vector<Agreement>& agreements, ConsistencyCounts& counts) {
  agreements.clear();
  const SurfacePoint point = BackProject(reference, x, y);
  const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
  int through = kOwnPlace;  // the last place from which the point is seen through
  for (int i = 0; i < int(candidates.size()); ++i) {
    const int place = places[std::size_t(i)];
    const std::size_t before = counts.seen_through;
    auto agreement = Ask(reference, pixel, point, *candidates[std::size_t(i)], limits, counts);
    if (counts.seen_through > before && (place == kOwnPlace || std::exchange(through, place) == place))
      counts.seen_through = before;
    if (!agreement) continue;
    agreement->view = i, agreement->place = place;
    agreements.push_back(*agreement);
  }
}

std::size_t PlacesOf(const std::vector<Agreement>& agreements) {
  std::size_t places = 0;
  int last = kOwnPlace;
  for (const Agreement& a : agreements)
    places += a.place != kOwnPlace && std::exchange(last, a.place) != a.place;
  return places;
}

CloudPoint FusePixel(const ViewMaps& reference, int x, int y,
                     const std::vector<std::shared_ptr<const ViewMaps>>& candidates,
                     const std::vector<Agreement>& agreements) {
  const SurfacePoint seed = BackProject(reference, x, y);
  const Eigen::Vector3d centre = reference.cam_from_world.Center(), ray = seed.position - centre;
  WeightedMean mean;
  mean.Add(reference, x, y, 1);
  double support = 0, best = 0;  // of all places, of the last one
  int place = kOwnPlace;
  for (const Agreement& a : agreements) {
    const ViewMaps& view = *candidates[std::size_t(a.view)];
    mean.Add(view, a.x, a.y, MeetsPlane(view, a.x, a.y, a.point, centre, ray));
    const Eigen::Vector3d to_view = (view.cam_from_world.Center() - seed.position).normalized();
    const double sine = to_view.dot(ray) > 0 ? 1 : to_view.cross(ray.normalized()).norm();
    if (std::exchange(place, a.place) != a.place) support += std::exchange(best, 0);
    best = std::max(best, sine * (1 - a.residual));
  }
  support += best;
  const Eigen::Vector3d colour = mean.colour / mean.weight;
  CloudPoint point;
  point.position = (centre + mean.along_ray / mean.weight * ray).cast<float>();
  point.normal = mean.normal.normalized().cast<float>();
  point.colour = {Byte(colour.x()), Byte(colour.y()), Byte(colour.z())};
  point.dop = float(mean.dop / mean.weight);
  point.confidence = float(1 - std::exp(-support));
  point.views = std::uint16_t(std::min<std::size_t>(PlacesOf(agreements) + 1, 65535));
  return point;
}

}  // namespace polarscan
