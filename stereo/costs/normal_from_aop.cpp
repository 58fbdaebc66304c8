// SPDX-License-Identifier: Apache-2.0
#include "stereo/costs/normal_from_aop.h"

#include <algorithm>
#include <cmath>

namespace polarscan {
namespace {

struct Residual {
  float share, length;
  bool diffuse;
};

Residual ResidualOf(const AopTable& t, int i, const Eigen::Vector3f& n) {
  const float d = t.diffuse[0][i] * n.x() + t.diffuse[1][i] * n.y() + t.diffuse[2][i] * n.z();
  const float s = t.specular[0][i] * n.x() + t.specular[1][i] * n.y() + t.specular[2][i] * n.z();
  const float length = d * d + s * s + AopTable::kLeastTilt;
  return {std::min(d * d, s * s) / length, length, d * d < s * s};
}

}  // namespace

void AopTable::Add(const AopConstraint& c) {
  if (count == kMost) return;
  for (int k = 0; k < 3; ++k) diffuse[k][count] = c.diffuse[k], specular[k][count] = c.specular[k];
  weight[count++] = c.weight;
}

void AopTable::Pad() {
  padded = (count + kBlock - 1) / kBlock * kBlock;
  for (int i = count; i < padded; ++i) {
    for (int k = 0; k < 3; ++k) diffuse[k][i] = specular[k][i] = 0;
    weight[i] = 0;
  }
}

Eigen::Matrix3f AopSystemScalar(const AopTable& table, const Eigen::Vector3f& normal, float softness) {
  Eigen::Matrix3f sum = Eigen::Matrix3f::Zero();
  for (int i = 0; i < table.count; ++i) {
    const Residual residual = ResidualOf(table, i, normal);
    const auto& fits = residual.diffuse ? table.diffuse : table.specular;
    const auto& fits_not = residual.diffuse ? table.specular : table.diffuse;
    const Eigen::Vector3f m(fits[0][i], fits[1][i], fits[2][i]),
        o(fits_not[0][i], fits_not[1][i], fits_not[2][i]);
    const float r = residual.share;
    sum += table.weight[i] / ((1 + r / softness) * residual.length) *
           ((1 - r) * m * m.transpose() - r * o * o.transpose());
  }
  return sum;
}

float AopEnergyScalar(const AopTable& table, const Eigen::Vector3f& normal, float softness) {
  float energy = 0;
  for (int i = 0; i < table.count; ++i) {
    const float r = ResidualOf(table, i, normal).share;
    energy += table.weight[i] * r / (r + softness);
  }
  return energy;
}

}  // namespace polarscan
