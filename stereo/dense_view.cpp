// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense_view.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/statistics.h"

namespace polarscan {
namespace {

constexpr double kSamePlace = 0.005;  // of the depth

double MiddleDepth(const DenseView& view) { return std::sqrt(view.depth_min * view.depth_max); }

}  // namespace

bool SamePlace(const DenseView& a, const DenseView& b) {
  const double distance = (a.cam_from_world.Center() - b.cam_from_world.Center()).norm();
  return distance < kSamePlace * std::min(MiddleDepth(a), MiddleDepth(b));
}

std::vector<int> Places(const std::vector<DenseView>& views) {
  std::vector<int> places, firsts;
  for (int i = 0; i < int(views.size()); ++i) {
    const auto first = std::ranges::find_if(
        firsts, [&](int f) { return SamePlace(views[std::size_t(f)], views[std::size_t(i)]); });
    places.push_back(first == firsts.end() ? i : *first);
    if (first == firsts.end()) firsts.push_back(i);
  }
  return places;
}

double NeighbourAngle(const std::vector<DenseView>& views) {
  std::vector<double> angles;
  for (const DenseView& view : views) {
    const Eigen::Vector3d ray = view.camera.Ray(view.camera.width / 2., view.camera.height / 2.);
    const Eigen::Vector3d middle = view.cam_from_world.Inverse() * Eigen::Vector3d(MiddleDepth(view) * ray);
    double nearest = 360;
    for (const DenseView& other : views)
      if (!SamePlace(view, other))
        nearest = std::min(nearest, AngleDegrees(view.cam_from_world.Center() - middle,
                                                 other.cam_from_world.Center() - middle));
    if (nearest < 360) angles.push_back(nearest);
  }
  return Median(std::move(angles));
}

}  // namespace polarscan
