// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/scene_points.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>
#include <map>

#include "core/similarity.h"
#include "core/statistics.h"

namespace polarscan {
namespace {

constexpr std::size_t kEnoughForMedian = 20;  // a view's points, for their median depth
constexpr double kParallel = 0.002;           // mean squared sine between axes: about 2.5 degrees
constexpr double kBaselinesToScene = 10.0;    // neighbours see it about 6 degrees apart

// Median distance from a camera to the next one elsewhere; 1 if all stand at one place.
double UsualBaseline(const std::vector<DenseView>& views) {
  std::vector<double> nearest;
  for (const DenseView& a : views) {
    double least = std::numeric_limits<double>::infinity();
    for (const DenseView& b : views)
      if (const double d = (a.cam_from_world.Center() - b.cam_from_world.Center()).norm(); d > 0)
        least = std::min(least, d);
    nearest.push_back(least);
  }
  const double baseline = nearest.empty() ? 0 : Median(nearest);
  return baseline > 0 && std::isfinite(baseline) ? baseline : 1;
}

}  // namespace

std::vector<ScenePoint> ScenePoints(const SparseModel& model, const std::vector<DenseView>& views) {
  std::map<std::string, int> index_of_name;
  for (std::size_t i = 0; i < views.size(); ++i) index_of_name[views[i].name] = int(i);
  std::map<std::uint32_t, int> index_of_image;
  for (const auto& [id, image] : model.images) {
    const auto found = index_of_name.find(ViewName(image.name));
    if (found != index_of_name.end()) index_of_image[id] = found->second;
  }
  std::vector<ScenePoint> points;
  for (const auto& [id, point] : model.points) {
    ScenePoint scene_point{point.position, {}};
    for (const ColmapPoint::Track& track : point.track) {
      const auto view = index_of_image.find(track.image_id);
      if (view == index_of_image.end() || Depth(views[std::size_t(view->second)], point.position) <= 0)
        continue;
      scene_point.views.push_back(view->second);
    }
    std::ranges::sort(scene_point.views);
    const auto repeated = std::ranges::unique(scene_point.views);
    scene_point.views.erase(repeated.begin(), repeated.end());
    if (scene_point.views.size() >= 2) points.push_back(std::move(scene_point));
  }
  return points;
}

double Depth(const DenseView& view, const Eigen::Vector3d& point) {
  return (view.cam_from_world * point).z();
}

std::optional<Eigen::Vector3d> AxesIntersection(const std::vector<DenseView>& views) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const DenseView& view : views) {
    const Eigen::Vector3d axis = view.cam_from_world.rotation.row(2);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    normal += across;
    right += across * view.cam_from_world.Center();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(normal);
  if (views.empty() || solver.eigenvalues()[0] < kParallel * double(views.size())) return {};
  const Eigen::Vector3d point = normal.ldlt().solve(right);
  const auto behind =
      std::ranges::count_if(views, [&](const DenseView& view) { return Depth(view, point) <= 0; });
  if (std::size_t(behind) * 2 > views.size()) return {};
  return point;
}

std::vector<double> FocusDepths(const std::vector<DenseView>& views, const std::vector<ScenePoint>& points) {
  std::vector<std::vector<double>> depths(views.size());
  for (const ScenePoint& point : points)
    for (const int view : point.views)
      depths[std::size_t(view)].push_back(Depth(views[std::size_t(view)], point.position));
  const auto centre = AxesIntersection(views);
  const double guess = kBaselinesToScene * UsualBaseline(views);
  std::vector<double> focus;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double at_centre = centre ? Depth(views[i], *centre) : 0;
    focus.push_back(depths[i].size() >= kEnoughForMedian ? Median(depths[i])
                    : at_centre > 0                      ? at_centre
                                                         : guess);
  }
  return focus;
}

void MoveToLocalFrame(SparseModel& model, Progress& progress) {
  std::vector<DenseView> views;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const auto& [id, image] : model.images) {
    DenseView view;
    view.name = ViewName(image.name), view.cam_from_world = image.cam_from_world;
    views.push_back(view);
    centre += view.cam_from_world.Center() / double(model.images.size());
  }
  if (views.empty()) return;
  std::vector<double> depths = FocusDepths(views, ScenePoints(model, views));
  double extent = Median(depths);
  for (const DenseView& view : views)
    extent = std::max(extent, (view.cam_from_world.Center() - centre).norm());
  const Eigen::Vector3d origin = LocalOrigin(centre, extent);
  if (origin.isZero(0)) return;
  MoveOrigin(model, origin);
  progress.Warn(fmt::format(
      "the poses lie far from 0, where files in single precision lose detail: all results are in a local "
      "frame; add the offset {} {} {} (scan.json, offset.txt) for the poses' coordinates",
      model.offset.x(), model.offset.y(), model.offset.z()));
}

}  // namespace polarscan
