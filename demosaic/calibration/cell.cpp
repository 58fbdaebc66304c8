// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/cell.h"

#include <Eigen/Dense>
#include <cmath>

namespace polarscan {
namespace {

// Determinant of the cell's rows without row `without`.
float Minor(const CellMatrix& cell, int without) {
  Eigen::Matrix3f rows;
  for (int i = 0, r = 0; i < 4; ++i)
    if (i != without) rows.row(r++) = cell.row(i);
  return rows.determinant();
}

constexpr float kSmallestMinor = 0.02f;  // of ideal polarizers: 0.25

}  // namespace

std::optional<float> MissingSample(const CellMatrix& cell, const CellSamples& samples, int missing) {
  const float own = Minor(cell, missing);
  if (std::abs(own) < kSmallestMinor) return std::nullopt;
  float sum = 0;
  for (int i = 0; i < 4; ++i)
    if (i != missing) sum += ((i - missing) % 2 ? 1.0f : -1.0f) * Minor(cell, i) * samples[i];
  return sum / own;
}

CellSamples CorrectCell(const CellMatrix& real, const CellMatrix& ideal, const CellSamples& samples) {
  const Eigen::Matrix3f normal = real.transpose() * real;
  const Eigen::Vector3f light = normal.inverse() * (real.transpose() * samples);
  CellSamples corrected;
  for (int i = 0; i < 4; ++i) {
    const float g = ideal.row(i).dot(real.row(i)) / real.row(i).squaredNorm();
    corrected[i] = g * samples[i] + (ideal.row(i) - g * real.row(i)).dot(light);
  }
  return corrected;
}

}  // namespace polarscan
