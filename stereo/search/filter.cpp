// SPDX-License-Identifier: Apache-2.0
#include "stereo/search/filter.h"

#include <array>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "stereo/costs/cost_terms.h"
#include "stereo/costs/pixel_cost.h"
#include "stereo/search/visibility.h"

namespace polarscan {
namespace {

class Filter {
 public:
  Filter(const Problem& problem, const StereoOptions& options)
      : problem_(problem),
        options_(options),
        window_(MakeWindow(options.window_radius, options.window_step, options.window_corners)),
        reader_(window_, options.sigma_color),
        max_cos_triangulation_(
            float(std::cos(options.filter_min_triangulation_angle_deg * std::numbers::pi / 180))) {}

  bool HasCue(int x, int y) const {  // eq. (11)
    const Image<PolarSample>& polar = problem_.reference->polar;
    if (!polar.empty() && polar(x, y).dop >= float(options_.filter_min_dop)) return true;
    Patch patch;
    reader_.Read(problem_.reference->gray, problem_.reference->mask, x, y, patch);
    return patch.variance * 255 * 255 >= float(options_.filter_min_variance);
  }

  // seen: by source, how well it matches, and least: from where on it counts.
  bool IsConsistent(int x, int y, const Hypothesis& estimate, const float* seen, float least) const {
    const Eigen::Vector3f ray = problem_.Ray(x, y), point = estimate.depth * ray;
    int consistent = 0;
    for (std::size_t s = 0; s < problem_.sources.size(); ++s) {
      const Source& source = problem_.sources[s];
      consistent += CosTriangulation(source, point) <= max_cos_triangulation_ &&
                    estimate.normal.dot(source.center - point) > 0 && seen[s] >= least &&
                    Agrees(source, ray, point);
    }
    return consistent >= std::min(options_.filter_min_consistent, int(problem_.sources.size()));
  }

 private:
  bool Agrees(const Source& source, const Eigen::Vector3f& ray, const Eigen::Vector3f& point) const {
    const float limit = float(options_.filter_max_reprojection_px);
    return !source.map ||
           GeometricError(problem_.reference->camera, source, Look(source, point), ray, limit + 1) <= limit;
  }

  const Problem& problem_;
  const StereoOptions& options_;
  const Window window_;
  const PatchReader reader_;
  const float max_cos_triangulation_;
};

template <class Keep>
void DropUnless(DepthNormalMap& map, Keep&& keep) {
  ParallelFor(0, map.depth.height(), [&](int y) {
    for (int x = 0; x < map.depth.width(); ++x) {
      if (map.depth(x, y) <= 0 || keep(x, y)) continue;
      map.depth(x, y) = 0;
      map.normal(x, y).setZero();
    }
  });
}

}  // namespace

void FilterEstimates(const Problem& problem, const StereoOptions& options,
                     const std::vector<float>& selection, DepthNormalMap& map) {
  const Filter filter(problem, options);
  const std::size_t sources = problem.sources.size();
  const std::vector<float> all(sources, 1.0f);
  const float least = Visibility(options.ncc_sigma).Likelihood(float(1 - options.filter_min_ncc));
  DropUnless(map, [&](int x, int y) {
    const std::size_t pixel = std::size_t(y) * std::size_t(map.depth.width()) + std::size_t(x);
    const float* seen = selection.empty() ? all.data() : &selection[pixel * sources];
    return filter.HasCue(x, y) && filter.IsConsistent(x, y, {map.depth(x, y), map.normal(x, y)}, seen, least);
  });
}

void FilterBySupport(const Problem& problem, const StereoOptions& options, const Image<float>& confidence,
                     DepthNormalMap& map) {
  Problem nearest = problem;
  if (nearest.sources.size() > kMaxSources) nearest.sources.resize(kMaxSources);
  const Filter filter(nearest, options);
  const PixelCost cost(nearest, options);
  const bool only_photos = problem.reference->polar.empty() && problem.reference->mask.empty();
  const auto matches = [&](int x, int y) {
    PixelContext pixel;
    cost.Place(x, y, pixel);
    const Hypothesis estimate{map.depth(x, y), map.normal(x, y)};
    std::array<float, kMaxSources> seen;
    for (std::size_t s = 0; s < nearest.sources.size(); ++s) seen[s] = 1 - cost.Match(pixel, estimate, s);
    return filter.IsConsistent(x, y, estimate, seen.data(), float(options.filter_min_ncc));
  };
  DropUnless(map, [&](int x, int y) {
    return confidence(x, y) >= float(options.filter_min_support) && filter.HasCue(x, y) &&
           (!only_photos || matches(x, y));
  });
}

}  // namespace polarscan
