// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <vector>

#include "stereo/costs/problem.h"

namespace polarscan {

// The terms of eq. (2) for one hypothesis, apart from the photometric one (ncc.h). Equation numbers are
// PolarPMS'. All vectors are in the reference camera's frame unless they say otherwise.

// Forward-backward reprojection error psi in pixels, at most max_px (also where the source has no depth), of
// eq. (6). As COLMAP: the source's depth is that of the nearest pixel. `ray`: of reference pixel (x, y), z =
// 1.
float GeometricError(const Pinhole& reference, const Source& source, const Seen& seen,
                     const Eigen::Vector3f& ray, float max_px);

// delta(eta) of eqs. (7), (8): 0 if the normal's azimuth fits the AoP up to multiples of 90 degrees, 1 if it
// is 45 degrees off.
class PolarizationResidual {
 public:
  explicit PolarizationResidual(const StereoOptions& options);
  // normal and the pixel's normalised coordinates (x, y), both of the camera that took the sample. The
  // azimuth is the direction of (n_x - n_z x, n_y - n_z y) in the picture (docs/conventions.md).
  float operator()(const PolarSample& sample, const Eigen::Vector3f& normal, float x, float y) const {
    const float ax = normal.x() - normal.z() * x, ay = normal.y() - normal.z() * y;
    const float c = sample.cos_phi, s = sample.sin_phi;
    // sin(2 (alpha - phi)) with alpha = atan2(-ay, ax), squared: sin^2(2 eta)
    const float across = -ay * c - ax * s, along = ax * c - ay * s;
    const float sine = 2 * across * along / (ax * ax + ay * ay + 1e-12f);
    return table_.empty() ? sine * sine : Lookup(std::min(1.0f, std::abs(sine)));
  }

 private:
  float Lookup(float sine) const {
    const float place = sine * float(table_.size() - 2);
    const int i = int(place);
    return table_[std::size_t(i)] +
           (place - float(i)) * (table_[std::size_t(i) + 1] - table_[std::size_t(i)]);
  }
  std::vector<float> table_;  // over |sin 2 eta|; empty: sin^2
};

// F_pol of eq. (7), summed view by view. "dop": the weighted mean as published. "noise": each view's residual
// counts by its weight, the sum is divided by the number of views, so that weak evidence fades instead of
// deciding.
class PolarimetricCost {
 public:
  explicit PolarimetricCost(bool normalised) : normalised_(normalised) {}
  void Add(const PolarSample& sample, float residual, float count) {
    cost_ += count * sample.weight * residual;
    weights_ += normalised_ ? count * sample.weight : count;
  }
  float Value() const { return weights_ > 0 ? cost_ / weights_ : 0; }
  // What the weighted residuals are multiplied by.
  float Scale() const { return weights_ > 0 ? 1 / weights_ : 0; }

 private:
  bool normalised_;
  float cost_ = 0, weights_ = 0;
};

// A neighbour of the pixel with its current estimate; depth 0: none.
struct Neighbour {
  Hypothesis estimate;
  Eigen::Vector3f ray;
};

// F_dep, eq. (10): 1 - n . n_dep with the plane through the pixel's point and those of a horizontal and a
// vertical neighbour. 0 if a neighbour is missing.
float DepthNormalAngle(const Hypothesis& hypothesis, const Eigen::Vector3f& ray, const Neighbour& horizontal,
                       const Neighbour& vertical);

// The depth at which `ray` meets the plane of an estimate made for `plane_ray`; 0 if it does not.
float DepthOnPlane(const Hypothesis& plane, const Eigen::Vector3f& plane_ray, const Eigen::Vector3f& ray);

}  // namespace polarscan
