// SPDX-License-Identifier: Apache-2.0
#include "stereo/costs/cost_terms.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace polarscan {

float GeometricError(const Pinhole& reference, const Source& source, const Seen& seen,
                     const Eigen::Vector3f& ray, float max_px) {
  if (!seen.inside()) return max_px;
  const float depth = source.map->depth(seen.u, seen.v);
  if (depth <= 0) return max_px;
  const Eigen::Vector3f there(depth * seen.x, depth * seen.y, depth);
  const Eigen::Vector3f back = source.rotation.transpose() * (there - source.translation);
  if (back.z() <= 0) return max_px;
  const float du = float(reference.fx) * (back.x() / back.z() - ray.x());
  const float dv = float(reference.fy) * (back.y() / back.z() - ray.y());
  return std::min(max_px, std::sqrt(du * du + dv * dv));
}

PolarizationResidual::PolarizationResidual(const StereoOptions& options) {
  if (options.polarization_residual == "sine") return;
  // theta = 1 - 4 eta / pi, delta = (exp(-k theta) - exp(-k)) / (1 - exp(-k)): Polarimetric MVIR (ECCV 2020).
  const double k = options.residual_steepness;
  constexpr int kSteps = 512;
  for (int i = 0; i <= kSteps; ++i) {
    const double eta = std::asin(double(i) / kSteps) / 2, theta = 1 - 4 * eta / std::numbers::pi;
    const double delta = (std::exp(-k * theta) - std::exp(-k)) / (1 - std::exp(-k));
    table_.push_back(float(std::pow(delta, options.residual_power)));
  }
  table_.push_back(table_.back());
}

float DepthOnPlane(const Hypothesis& plane, const Eigen::Vector3f& plane_ray, const Eigen::Vector3f& ray) {
  const float facing = plane.normal.dot(ray);
  if (plane.depth <= 0 || facing > -1e-4f) return 0;
  return plane.depth * plane.normal.dot(plane_ray) / facing;
}

float DepthNormalAngle(const Hypothesis& hypothesis, const Eigen::Vector3f& ray, const Neighbour& horizontal,
                       const Neighbour& vertical) {
  if (horizontal.estimate.depth <= 0 || vertical.estimate.depth <= 0) return 0;
  const Eigen::Vector3f here = hypothesis.depth * ray;
  const Eigen::Vector3f h = horizontal.estimate.depth * horizontal.ray - here;
  const Eigen::Vector3f v = vertical.estimate.depth * vertical.ray - here;
  Eigen::Vector3f n_dep = h.cross(v);
  const float length = n_dep.norm();
  if (length <= 0) return 0;
  n_dep /= n_dep.dot(ray) > 0 ? -length : length;
  return 1 - hypothesis.normal.dot(n_dep);
}

}  // namespace polarscan
