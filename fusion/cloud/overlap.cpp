// SPDX-License-Identifier: Apache-2.0
#include "fusion/cloud/overlap.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <ranges>
#include <utility>

#include "fusion/cloud/consistency.h"

namespace polarscan {
namespace {

constexpr std::size_t kSample = 2000;  // points asked about, of the many
constexpr double kMinFacing = 0.1;     // cosine of the steepest view onto a point that counts

std::vector<SurfacePoint> SomePoints(const ViewMaps& maps) {
  std::vector<std::pair<int, int>> pixels;
  for (int y = 0; y < maps.depth.height(); ++y)
    for (int x = 0; x < maps.depth.width(); ++x)
      if (maps.depth(x, y) > 0) pixels.emplace_back(x, y);
  std::vector<SurfacePoint> points;
  const std::size_t step = std::max<std::size_t>(1, pixels.size() / kSample);
  for (std::size_t i = step / 2; i < pixels.size(); i += step)
    points.push_back(BackProject(maps, pixels[i].first, pixels[i].second));
  return points;
}

bool MaySee(const DenseView& view, const SurfacePoint& point) {
  const Eigen::Vector3d to_view = (view.cam_from_world.Center() - point.position).normalized();
  return view.camera.Sees(view.cam_from_world * point.position) && to_view.dot(point.normal) > kMinFacing;
}

}  // namespace

std::vector<int> OverlappingViews(const Workspace& workspace, int reference, const ViewMaps& maps,
                                  const std::vector<bool>& usable, const std::vector<int>& places,
                                  int limit) {
  const std::vector<SurfacePoint> points = SomePoints(maps);
  std::vector<std::pair<long, int>> ranked;  // (-points seen, view)
  for (int i = 0; i < int(workspace.views.size()); ++i) {
    if (i == reference || !usable[std::size_t(i)]) continue;
    const DenseView& view = workspace.views[std::size_t(i)];
    const long seen = std::ranges::count_if(points, [&](const SurfacePoint& p) { return MaySee(view, p); });
    if (seen > 0) ranked.emplace_back(-seen, i);
  }
  std::ranges::sort(ranked);
  std::vector<bool> taken(workspace.views.size());
  taken[std::size_t(places[std::size_t(reference)])] = true;
  std::vector<std::pair<long, int>> others;  // from places that are there already
  std::erase_if(ranked, [&](const auto& entry) {
    const auto place = std::size_t(places[std::size_t(entry.second)]);
    const bool again = taken[place];
    if (again) others.push_back(entry);
    taken[place] = true;
    return again;
  });
  ranked.insert(ranked.end(), others.begin(), others.end());
  ranked.resize(std::min(ranked.size(), std::size_t(limit)));
  std::vector<int> views;
  for (const auto& [rank, view] : ranked) views.push_back(view);
  std::ranges::sort(views, {}, [&](int view) { return std::pair(places[std::size_t(view)], view); });
  return views;
}

std::vector<int> WalkingOrder(const Workspace& workspace) {
  std::vector<Eigen::Vector3d> centers;
  for (const DenseView& view : workspace.views) centers.push_back(view.cam_from_world.Center());
  std::vector<int> order(centers.size());
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = 1; i < order.size(); ++i) {
    const Eigen::Vector3d& here = centers[std::size_t(order[i - 1])];
    const auto left = std::ranges::subrange(order.begin() + long(i), order.end());
    const auto nearest = std::ranges::min_element(left, {}, [&](int view) {
      return std::pair((centers[std::size_t(view)] - here).squaredNorm(), view);
    });
    std::swap(order[i], *nearest);
  }
  return order;
}

}  // namespace polarscan
