// SPDX-License-Identifier: Apache-2.0
#include "stereo/costs/pixel_cost.h"

#include <algorithm>

#include "stereo/costs/hull_intervals.h"

namespace polarscan {
namespace {

constexpr PolarSample kCertain{.weight = 1};

// Whether the source sees it inside of its picture and of its mask, if it has one.
bool OnObject(const Source& source, const Seen& seen) {
  return seen.inside() && (source.view->mask.empty() || source.view->mask(seen.u, seen.v));
}

}  // namespace

PixelCost::PixelCost(const Problem& problem, const StereoOptions& options)
    : problem_(problem),
      options_(options),
      window_(MakeWindow(options.window_radius, options.window_step, options.window_corners)),
      reader_(window_, options.sigma_color),
      contrast_{float(options.ncc_epsilon), float(options.reference_min_variance),
                float(options.source_min_variance)},
      residual_(options),
      sources_(problem.sources.size()),
      geometric_(!problem.sources.empty() && problem.sources[0].map != nullptr),
      polarized_(!problem.reference->polar.empty()),
      depth_normal_(options.depth_normal && options.depth_normal_weight > 0),
      silhouettes_(options.silhouettes),
      normalised_polarization_(options.polarization_evidence == "dop") {}

void PixelCost::Place(int x, int y, PixelContext& pixel) const {
  pixel.x = x, pixel.y = y, pixel.ray = problem_.Ray(x, y);
  for (std::size_t s = 0; s < sources_; ++s) pixel.turned_rays[s] = problem_.sources[s].rotation * pixel.ray;
  reader_.Read(problem_.reference->gray, problem_.reference->mask, x, y, pixel.patch);
}

float PixelCost::Match(const PixelContext& pixel, const Hypothesis& hypothesis, std::size_t source) const {
  const Source& s = problem_.sources[source];
  const Warp warp =
      PlaneWarp(problem_.reference->camera, s, pixel.ray, pixel.turned_rays[source], hypothesis);
  return NccCostSimd(window_, pixel.patch, warp, s.view->packed, contrast_);
}

Eigen::Vector3f PixelCost::ClosedFormNormal(const PixelContext& pixel, const Hypothesis& start,
                                            AopLabels labels) const {
  std::array<AopConstraint, kMaxSources + 1> constraints;
  std::size_t count = 0;
  const PolarSample& own = problem_.reference->polar(pixel.x, pixel.y);
  if (own.weight > 0) constraints[count++] = MakeAopConstraint(own, pixel.ray.x(), pixel.ray.y());
  for (const PixelContext::Chosen& chosen : pixel.Sources()) {
    const Source& source = problem_.sources[chosen.source];
    const Seen seen = Look(pixel, chosen.source, start.depth);
    if (!seen.inside()) continue;
    constraints[count++] = MakeAopConstraint(source, source.view->polar(seen.u, seen.v), seen);
  }
  return NormalFromAop({constraints.data(), count}, labels, start.normal, pixel.ray);
}

template <class Add>
void PixelCost::ForEachAop(const PixelContext& pixel, const Hypothesis& hypothesis, const SeenBy& seen,
                           Add&& add) const {
  const PolarSample& own = problem_.reference->polar(pixel.x, pixel.y);
  add(own, residual_(own, hypothesis.normal, pixel.ray.x(), pixel.ray.y()), 1);
  for (const PixelContext::Chosen& chosen : pixel.Sources()) {
    const Seen& there = seen[chosen.source];
    const Source& source = problem_.sources[chosen.source];
    if (options_.count_unseen && !OnObject(source, there)) {
      add(kCertain, 1, chosen.count);
      continue;
    }
    if (!there.inside()) continue;
    const PolarSample& sample = source.view->polar(there.u, there.v);
    const Eigen::Vector3f normal = source.rotation * hypothesis.normal;
    add(sample, residual_(sample, normal, there.x, there.y), chosen.count);
  }
}

float PixelCost::PolarizationTerm(const PixelContext& pixel, const Hypothesis& hypothesis,
                                  const SeenBy& seen) const {  // F_pol, eq. (7)
  PolarimetricCost cost(normalised_polarization_);
  ForEachAop(pixel, hypothesis, seen, [&](const PolarSample& sample, float residual, float count) {
    cost.Add(sample, residual, count);
  });
  return cost.Value();
}

float PixelCost::DepthNormalTerm(const PixelContext& pixel,
                                 const Hypothesis& hypothesis) const {  // F_dep, eq. (10)
  const Neighbour& beside = pixel.neighbours[pixel.neighbours[2].estimate.depth > 0 ? 2 : 3];
  return DepthNormalAngle(hypothesis, pixel.ray, pixel.neighbours[0], beside);
}

bool PixelCost::OutsideHull(const SeenBy& seen) const {
  for (std::size_t s = 0; s < sources_; ++s)
    if (OutsideSilhouette(problem_.sources[s], seen[s])) return true;
  return false;
}

float PixelCost::GeometricTerm(const PixelContext& pixel, std::size_t source, const SeenBy& seen) const {
  return float(options_.geometric_weight) * 0.5f *
         GeometricError(problem_.reference->camera, problem_.sources[source], seen[source], pixel.ray,
                        float(options_.geometric_max_px));
}

void PixelCost::LookAtSources(const PixelContext& pixel, float depth, SeenBy& seen) const {
  if (silhouettes_)
    for (std::size_t s = 0; s < sources_; ++s) seen[s] = Look(pixel, s, depth);
  else if (polarized_ || geometric_)
    for (const PixelContext::Chosen& d : pixel.Sources()) seen[d.source] = Look(pixel, d.source, depth);
}

float PixelCost::Total(const PixelContext& pixel, const Hypothesis& hypothesis, const float* known,
                       float bound) const {
  float cost = 0;
  if (depth_normal_) cost += float(options_.depth_normal_weight) * DepthNormalTerm(pixel, hypothesis);
  if (cost >= bound) return cost;
  SeenBy seen;
  LookAtSources(pixel, hypothesis.depth, seen);
  if (silhouettes_ && OutsideHull(seen)) cost += 1;
  if (polarized_) cost += float(options_.polarization_weight) * PolarizationTerm(pixel, hypothesis, seen);
  if (geometric_)
    for (const PixelContext::Chosen& d : pixel.Sources())
      cost += d.share * GeometricTerm(pixel, d.source, seen);
  const float photometric_weight = PhotometricWeight();
  for (const PixelContext::Chosen& d : pixel.Sources()) {
    if (cost >= bound) break;
    cost += d.share * photometric_weight * (known ? known[d.source] : Match(pixel, hypothesis, d.source));
  }
  return cost;
}

std::size_t PixelCost::TermCount(const PixelContext& pixel) const {
  return std::size_t(depth_normal_) + std::size_t(silhouettes_) + (polarized_ ? 1 + pixel.chosen_count : 0) +
         (geometric_ ? 2 : 1) * pixel.chosen_count;
}

std::size_t PixelCost::Terms(const PixelContext& pixel, const Hypothesis& hypothesis, float* terms) const {
  float* const first = terms;
  SeenBy seen;
  LookAtSources(pixel, hypothesis.depth, seen);
  if (depth_normal_)
    *terms++ = float(options_.depth_normal_weight) * std::max(0.0f, DepthNormalTerm(pixel, hypothesis));
  if (silhouettes_) *terms++ = OutsideHull(seen) ? 1 : 0;
  if (polarized_) {
    PolarimetricCost sum(normalised_polarization_);
    float* const views = terms;
    ForEachAop(pixel, hypothesis, seen, [&](const PolarSample& sample, float residual, float count) {
      sum.Add(sample, residual, count);
      *terms++ = count * sample.weight * residual;
    });
    const float scale = float(options_.polarization_weight) * sum.Scale();
    for (float* view = views; view < terms; ++view) *view *= scale;
    terms = std::fill_n(terms, views + 1 + pixel.chosen_count - terms, 0.0f);  // sources that do not see it
  }
  for (const PixelContext::Chosen& d : pixel.Sources()) {
    if (geometric_) *terms++ = d.share * GeometricTerm(pixel, d.source, seen);
    *terms++ = d.share * PhotometricWeight() * Match(pixel, hypothesis, d.source);
  }
  return std::size_t(terms - first);
}

}  // namespace polarscan
