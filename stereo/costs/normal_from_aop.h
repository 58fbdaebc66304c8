// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>

#include "stereo/costs/hypotheses.h"

namespace polarscan {

// What AoP samples say about one pixel's normal n, by component and padded to whole vectors with weight 0. A
// constraint's residual is the smaller of (m_d.n)^2 and (m_s.n)^2 as a share of their sum, which is the
// squared sine of the angle between n and the line of sight: without that division the best normal would
// always be one that turns to the cameras. The angle is not known that well near 0, where kLeastTilt is
// added.
struct AopTable {
  static constexpr int kMost = 80, kBlock = 16;
  static constexpr float kLeastTilt = 0.1f;
  alignas(64) float diffuse[3][kMost], specular[3][kMost], weight[kMost];
  int count = 0, padded = 0;

  // More than kMost are left out.
  void Add(const AopConstraint& constraint);
  // Call once after the last Add.
  void Pad();
};

// One step of re-weighted least squares around `normal` asks for the smallest eigenvector of the sum over all
// constraints of w / (1 + r / softness) / length ((1 - r) m m^T - r o o^T), with residual r, m the vector
// that fits (diffuse or specular), o the other one.
Eigen::Matrix3f AopSystemScalar(const AopTable& table, const Eigen::Vector3f& normal, float softness);
Eigen::Matrix3f AopSystemSimd(const AopTable& table, const Eigen::Vector3f& normal, float softness);

// Sum of w r / (r + softness).
float AopEnergyScalar(const AopTable& table, const Eigen::Vector3f& normal, float softness);
float AopEnergySimd(const AopTable& table, const Eigen::Vector3f& normal, float softness);

}  // namespace polarscan
