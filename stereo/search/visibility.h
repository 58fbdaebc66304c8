// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cmath>
#include <span>

#include "core/random.h"
#include "stereo/costs/problem.h"

namespace polarscan {

// Pixelwise source selection of COLMAP (Schoenberger et al., ECCV 2016, section 4.1 and 4.2): along a line of
// pixels each source is a two-state hidden Markov chain, visible or not, whose evidence is the matching cost
// 1 - NCC.
class Visibility {
 public:
  explicit Visibility(double ncc_sigma);
  // Likelihood of the cost if the source sees the point: a Gaussian in 1 - NCC, normalised on [0, 2].
  float Likelihood(float cost) const { return scale_ * std::exp(cost * cost * exponent_); }
  // One step of the forward and of the backward message (probabilities of "visible").
  float Forward(float cost, float previous) const;
  float Backward(float cost, float next) const;
  // Probability of "visible" given both messages at a pixel.
  static float Posterior(float forward, float backward) {
    const float yes = forward * backward, no = (1 - forward) * (1 - backward);
    return yes / (yes + no);
  }

 private:
  float scale_, exponent_;
};

// Prior that a source is useful for a hypothesis: triangulation angle, angle of incidence, resolution
// (section 4.3).
class SourcePrior {
 public:
  explicit SourcePrior(const StereoOptions& options);
  float operator()(const Problem& problem, const Source& source, const Eigen::Vector3f& ray,
                   const Eigen::Vector3f& turned_ray, const Hypothesis& hypothesis) const;

 private:
  float min_cos_triangulation_, incident_exponent_;
};

// Cosine of the angle at `point` between the reference camera (at the origin) and the source's.
float CosTriangulation(const Source& source, const Eigen::Vector3f& point);

// Draws `samples` sources with the given weights (not normalised) and counts how often each came. If all
// weights are 0, each source counts once.
void DrawSources(std::span<const float> weights, int samples, Random& random, std::span<int> counts);

}  // namespace polarscan
