// SPDX-License-Identifier: Apache-2.0
#include "stereo/search/visibility.h"

#include <algorithm>
#include <numbers>

namespace polarscan {
namespace {
constexpr float kChange = 1e-5f;  // probability that visibility changes from one pixel to the next
constexpr float kUniform = 0.5f;  // likelihood of any cost if the source does not see the point
}  // namespace

Visibility::Visibility(double sigma) : exponent_(float(-0.5 / (sigma * sigma))) {
  const double area = sigma * std::sqrt(std::numbers::pi / 2) * std::erf(2 / (sigma * std::numbers::sqrt2));
  scale_ = float(1 / area);
}

float Visibility::Forward(float cost, float previous) const {
  const float yes = (previous * (1 - kChange) + (1 - previous) * kChange) * Likelihood(cost);
  const float no = (previous * kChange + (1 - previous) * (1 - kChange)) * kUniform;
  return yes / (yes + no);
}

float Visibility::Backward(float cost, float next) const {
  const float seen = next * Likelihood(cost), unseen = (1 - next) * kUniform;
  const float yes = seen * (1 - kChange) + unseen * kChange;
  const float no = seen * kChange + unseen * (1 - kChange);
  return yes / (yes + no);
}

SourcePrior::SourcePrior(const StereoOptions& options)
    : min_cos_triangulation_(float(std::cos(options.min_triangulation_angle_deg * std::numbers::pi / 180))),
      incident_exponent_(float(-0.5 / (options.incident_angle_sigma * options.incident_angle_sigma))) {}

float CosTriangulation(const Source& source, const Eigen::Vector3f& point) {
  const Eigen::Vector3f to_source = source.center - point;
  return -point.dot(to_source) / std::sqrt(point.squaredNorm() * to_source.squaredNorm());
}

float SourcePrior::operator()(const Problem& problem, const Source& source, const Eigen::Vector3f& ray,
                              const Eigen::Vector3f& turned_ray, const Hypothesis& hypothesis) const {
  const Eigen::Vector3f point = hypothesis.depth * ray, to_source = source.center - point;
  const float cos_triangulation = std::abs(CosTriangulation(source, point));
  float prior = 1;
  if (cos_triangulation > min_cos_triangulation_) {
    const float scaled = 1 - (1 - cos_triangulation) / (1 - min_cos_triangulation_);
    prior = std::clamp(1 - scaled * scaled, 0.0f, 1.0f);
  }
  const float missing = 1 - std::max(0.0f, hypothesis.normal.dot(to_source) / to_source.norm());
  prior *= std::exp(missing * missing * incident_exponent_);
  const Warp w = PlaneWarp(problem.reference->camera, source, ray, turned_ray, hypothesis);
  const float u = w.u0 / w.w0, v = w.v0 / w.w0;
  const float area =
      std::abs((w.ux - u * w.wx) * (w.vy - v * w.wy) - (w.uy - u * w.wy) * (w.vx - v * w.wx)) / (w.w0 * w.w0);
  return prior * std::min(area, 1 / std::max(area, 1e-12f));
}

void DrawSources(std::span<const float> weights, int samples, Random& random, std::span<int> counts) {
  float total = 0;
  for (float weight : weights) total += weight;
  if (!(total > 0)) {
    std::ranges::fill(counts, 1);
    return;
  }
  std::ranges::fill(counts, 0);
  for (int i = 0; i < samples; ++i) {
    float left = random.Uniform(0, total);
    std::size_t chosen = 0;
    while (chosen + 1 < weights.size() && left >= weights[chosen]) left -= weights[chosen++];
    ++counts[chosen];
  }
}

}  // namespace polarscan
