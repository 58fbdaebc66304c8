// SPDX-License-Identifier: Apache-2.0
#include "stereo/polarpms/hull.h"

#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr int kSteps = 96;

DepthInterval HullInterval(const Eigen::Vector3f& ray, float depth_min, float depth_max,
                           std::span<const Source> views) {
  DepthInterval interval;
  std::size_t last_excluder = 0;  // the view that excluded the last sample mostly excludes the next one, too
  const float step = (depth_max - depth_min) / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const float depth = depth_min + (float(i) + 0.5f) * step;
    bool inside = true;
    for (std::size_t k = 0; inside && k < views.size(); ++k) {
      const std::size_t view = (k + last_excluder) % views.size();
      if (!OutsideSilhouette(views[view], Look(views[view], depth * ray))) continue;
      inside = false;
      last_excluder = view;
    }
    if (!inside) continue;
    if (interval.far_depth <= 0) interval.near_depth = depth - step;
    interval.far_depth = depth + step;
  }
  return interval.far_depth > 0 ? interval : DepthInterval{depth_min, depth_max};
}

}  // namespace

Image<DepthInterval> VisualHull(const Problem& problem, std::span<const Source> views) {
  const int width = problem.reference->gray.width(), height = problem.reference->gray.height();
  Image<DepthInterval> hull(width, height, {problem.depth_min, problem.depth_max});
  if (views.empty()) return hull;
  ParallelFor(0, height, [&](int y) {
    for (int x = 0; x < width; ++x)
      if (problem.Active(x, y))
        hull(x, y) = HullInterval(problem.Ray(x, y), problem.depth_min, problem.depth_max, views);
  });
  return hull;
}

}  // namespace polarscan
