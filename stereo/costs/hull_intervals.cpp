// SPDX-License-Identifier: Apache-2.0
#include "stereo/costs/hull_intervals.h"

#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr int kSteps = 96;

DepthInterval HullInterval(const Eigen::Vector3f& ray, float depth_min, float depth_max,
                           std::span<const Source> views, std::vector<Eigen::Vector3f>& turned_rays) {
  for (std::size_t k = 0; k < views.size(); ++k) turned_rays[k] = views[k].rotation * ray;
  const float step = (depth_max - depth_min) / kSteps;
  std::size_t excluder = 0;  // the view that excluded the last sample mostly excludes the next one, too
  const auto excluded = [&](int sample) {
    const float depth = depth_min + (float(sample) + 0.5f) * step;
    for (std::size_t k = 0; k < views.size(); ++k) {
      const Source& view = views[excluder];
      if (OutsideSilhouette(view, LookAt(view, depth * turned_rays[excluder] + view.translation)))
        return true;
      excluder = excluder + 1 < views.size() ? excluder + 1 : 0;
    }
    return false;
  };
  int first = 0, last = kSteps - 1;
  while (first < kSteps && excluded(first)) ++first;
  if (first == kSteps) return {depth_min, depth_max};
  while (last > first && excluded(last)) --last;
  return {depth_min + (float(first) - 0.5f) * step, depth_min + (float(last) + 1.5f) * step};
}

}  // namespace

Image<DepthInterval> VisualHull(const Problem& problem, std::span<const Source> views) {
  const int width = problem.reference->gray.width(), height = problem.reference->gray.height();
  Image<DepthInterval> hull(width, height, {problem.depth_min, problem.depth_max});
  if (views.empty()) return hull;
  ParallelFor(0, height, [&](int y) {
    std::vector<Eigen::Vector3f> turned_rays(views.size());
    for (int x = 0; x < width; ++x)
      if (problem.Active(x, y))
        hull(x, y) =
            HullInterval(problem.Ray(x, y), problem.depth_min, problem.depth_max, views, turned_rays);
  });
  return hull;
}

}  // namespace polarscan
