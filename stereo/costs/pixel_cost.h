// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <span>

#include "stereo/costs/cost_terms.h"
#include "stereo/costs/hypotheses.h"
#include "stereo/costs/problem.h"

namespace polarscan {

constexpr int kMaxSources = 32;
constexpr std::size_t kMaxTerms = 3 * kMaxSources + 3;  // of PixelCost::Terms

// What the pixel being updated knows before any hypothesis is judged.
struct PixelContext {
  int x = 0, y = 0;
  Eigen::Vector3f ray;
  std::array<Eigen::Vector3f, kMaxSources> turned_rays;  // the ray in each source's frame
  Patch patch;
  std::array<Neighbour, 4> neighbours;
  // The sources whose matching decides, the most important first: their shares of the photometric cost (sum
  // 1) and their weights beside the reference view's own AoP, which counts 1.
  struct Chosen {
    std::size_t source;
    float share;
    float count;
  };
  std::array<Chosen, kMaxSources> chosen;
  std::size_t chosen_count = 0;
  std::span<const Chosen> Sources() const { return {chosen.data(), chosen_count}; }
};

// Eq. (2): what a hypothesis costs at a pixel. Both schedules use it.
class PixelCost {
 public:
  PixelCost(const Problem& problem, const StereoOptions& options);

  // Sets the pixel's place, rays and reference patch.
  void Place(int x, int y, PixelContext& pixel) const;
  // 1 - NCC with one source.
  float Match(const PixelContext& pixel, const Hypothesis& hypothesis, std::size_t source) const;
  // `known`: the matching costs of this hypothesis by source, if they are known. Gives up, with any value >=
  // bound, once the cost cannot stay below it: every term is non-negative.
  float Total(const PixelContext& pixel, const Hypothesis& hypothesis, const float* known, float bound) const;
  // The addends of Total, each 0 or more, a fixed number of them for a pixel.
  std::size_t TermCount(const PixelContext& pixel) const;
  std::size_t Terms(const PixelContext& pixel, const Hypothesis& hypothesis, float* terms) const;
  // The normal that the AoP of the reference and of the chosen sources asks for at a depth; the start's if
  // they do not say.
  Eigen::Vector3f ClosedFormNormal(const PixelContext& pixel, const Hypothesis& start,
                                   AopLabels labels) const;

  bool polarized() const { return polarized_; }
  std::size_t sources() const { return sources_; }

 private:
  // A point in each source; filled where it is asked for.
  using SeenBy = std::array<Seen, kMaxSources>;
  Seen Look(const PixelContext& pixel, std::size_t source, float depth) const {
    const Source& s = problem_.sources[source];
    return LookAt(s, depth * pixel.turned_rays[source] + s.translation);
  }
  // add(sample, residual, count) for the reference view and each chosen source.
  template <class Add>
  void ForEachAop(const PixelContext& pixel, const Hypothesis& hypothesis, const SeenBy& seen,
                  Add&& add) const;
  float PolarizationTerm(const PixelContext& pixel, const Hypothesis& hypothesis, const SeenBy& seen) const;
  float DepthNormalTerm(const PixelContext& pixel, const Hypothesis& hypothesis) const;
  float GeometricTerm(const PixelContext& pixel, std::size_t source, const SeenBy& seen) const;
  // F_pho + tau_geo F_geo: F_geo contains F_pho again.
  float PhotometricWeight() const { return geometric_ ? 1 + float(options_.geometric_weight) : 1; }
  void LookAtSources(const PixelContext& pixel, float depth, SeenBy& seen) const;
  bool OutsideHull(const SeenBy& seen) const;

  const Problem& problem_;
  const StereoOptions& options_;
  const Window window_;
  const PatchReader reader_;
  const Contrast contrast_;
  const PolarizationResidual residual_;
  const std::size_t sources_;
  const bool geometric_, polarized_, depth_normal_, silhouettes_, normalised_polarization_;
};

}  // namespace polarscan
