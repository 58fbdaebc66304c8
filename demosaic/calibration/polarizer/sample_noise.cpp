// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/polarizer/sample_noise.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "demosaic/calibration/response.h"

namespace polarscan {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Matrix4Xd;
using Eigen::MatrixX3d;
using Eigen::RowVector3d;

constexpr int kNoiseRounds = 4;
constexpr double kLeastFree = 0.02;   // of a reading's noise: else the fit follows it, whatever it is
constexpr double kLeastShare = 1e-3;  // of the mean variance: that of a reading without light

// Derivatives of angle (degrees) and diattenuation by a response.
Eigen::Matrix<double, 2, 3> ShapeJacobian(const RowVector3d& a) {
  const double square = a[1] * a[1] + a[2] * a[2], size = std::sqrt(square);
  Eigen::Matrix<double, 2, 3> jacobian;
  jacobian << 0, -a[2] / square / 2 / kRadPerDeg, a[1] / square / 2 / kRadPerDeg,  //
      -size / (a[0] * a[0]), a[1] / (size * a[0]), a[2] / (size * a[0]);
  return jacobian;
}

ResponseDeviation DeviationOf(const Eigen::Matrix2d& covariance) {
  return {std::sqrt(std::max(0.0, covariance(0, 0))), std::sqrt(std::max(0.0, covariance(1, 1)))};
}

// Sums for the line of squares over light.
struct LineSums {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;

  void Add(double light, double square, double weight) {
    n += weight, x += weight * light, y += weight * square;
    xx += weight * light * light, xy += weight * light * square;
  }
  SampleNoise Line() const {
    const double determinant = n * xx - x * x;
    const double slope = determinant > 1e-12 * n * xx ? std::max(0.0, (n * xy - x * y) / determinant) : 0;
    return {std::max((y - slope * x) / n, kLeastShare * y / n), slope};
  }
};

// Of each angle's pixels, by weights 4 x K.
std::array<Matrix3d, 4> NormalInverses(const Matrix3Xd& stokes, const Matrix4Xd& weights) {
  std::array<Matrix3d, 4> inverses;
  for (Eigen::Index angle = 0; angle < 4; ++angle)
    inverses[std::size_t(angle)] =
        Matrix3d(stokes * weights.row(angle).asDiagonal() * stokes.transpose()).inverse();
  return inverses;
}

// The noise by what readings miss a weighted fit by.
SampleNoise FitNoise(const PolarizerReadings& readings, const MatrixX3d& responses, const Matrix3Xd& stokes,
                     const Matrix4Xd& weights, const SampleNoise& before) {
  const std::array<Matrix3d, 4> inverses = NormalInverses(stokes, weights);
  LineSums sums;
  for (Eigen::Index k = 0; k < stokes.cols(); ++k) {
    std::array<double, 4> free{};  // share of the noise that the fit did not follow
    for (std::size_t i = 0; i < 4; ++i)
      free[i] = 1 - weights(Eigen::Index(i), k) * stokes.col(k).dot(inverses[i] * stokes.col(k));
    const Eigen::VectorXd expected = responses * stokes.col(k);
    for (Eigen::Index i = 0; i < expected.size(); ++i) {
      const double share = free[std::size_t(readings.angles_deg[std::size_t(i)] / 45)];
      if (share < kLeastFree) continue;
      const double off = double(readings.light(i, k)) - expected[i], variance = before.Variance(expected[i]);
      sums.Add(std::max(0.0, expected[i]), off * off / share, 1 / (variance * variance));
    }
  }
  return sums.Line();
}

}  // namespace

MatrixX3d FitResponses(const PolarizerReadings& readings, const Matrix3Xd& stokes, const Matrix4Xd& weights) {
  const std::array<Matrix3d, 4> inverses = NormalInverses(stokes, weights);
  std::array<Eigen::MatrixX3f, 4> solvers;  // K x 3
  for (std::size_t i = 0; i < 4; ++i)
    solvers[i] = (weights.row(Eigen::Index(i)).asDiagonal() * stokes.transpose() * inverses[i]).cast<float>();
  MatrixX3d responses(readings.light.rows(), 3);
  for (Eigen::Index i = 0; i < responses.rows(); ++i)
    responses.row(i) =
        (readings.light.row(i) * solvers[std::size_t(readings.angles_deg[std::size_t(i)] / 45)])
            .cast<double>();
  return responses;
}

MatrixX3d FitResponses(const PolarizerReadings& readings, const Matrix3Xd& stokes) {
  return FitResponses(readings, stokes, Matrix4Xd::Ones(4, stokes.cols()));
}

WeighedFit WeighByNoise(const PolarizerReadings& readings, const Matrix3Xd& stokes) {
  WeighedFit fit{.weights = Matrix4Xd::Ones(4, stokes.cols()), .noise = {1, 0}};
  for (int round = 0;; ++round) {
    const MatrixX3d responses = FitResponses(readings, stokes, fit.weights);
    fit.means = MeansByAngle(readings, responses);
    if (round == kNoiseRounds) return fit;
    const SampleNoise noise = FitNoise(readings, responses, stokes, fit.weights, fit.noise);
    if (!(noise.constant > 0)) return fit;  // readings without any noise
    fit.noise = noise;
    fit.weights = WeightsOf(fit.noise, fit.means, stokes);
  }
}

MeanResponses MeansByAngle(const PolarizerReadings& readings, const MatrixX3d& responses) {
  MeanResponses means = MeanResponses::Zero();
  Eigen::Vector4d counts = Eigen::Vector4d::Zero();
  for (Eigen::Index i = 0; i < responses.rows(); ++i) {
    const Eigen::Index angle = readings.angles_deg[std::size_t(i)] / 45;
    means.row(angle) += responses.row(i);
    counts[angle] += 1;
  }
  for (Eigen::Index angle = 0; angle < 4; ++angle) means.row(angle) /= std::max(1.0, counts[angle]);
  return means;
}

Matrix4Xd WeightsOf(const SampleNoise& noise, const MeanResponses& means, const Matrix3Xd& stokes) {
  Matrix4Xd weights = means * stokes;
  for (double& value : weights.reshaped()) value = 1 / noise.Variance(value);
  return weights / weights.mean();
}

std::array<ResponseDeviation, 4> DeviationsByNoise(const WeighedFit& fit, const Matrix3Xd& stokes) {
  Matrix4Xd weights = fit.means * stokes;
  for (double& value : weights.reshaped()) value = 1 / fit.noise.Variance(value);
  const std::array<Matrix3d, 4> inverses = NormalInverses(stokes, weights);
  std::array<ResponseDeviation, 4> deviations;
  for (std::size_t angle = 0; angle < 4; ++angle) {
    const auto jacobian = ShapeJacobian(fit.means.row(Eigen::Index(angle)));
    deviations[angle] = DeviationOf(jacobian * inverses[angle] * jacobian.transpose());
  }
  return deviations;
}

std::array<ResponseDeviation, 4> DeviationsByLight(const Eigen::Matrix<double, 9, 9>& covariance,
                                                   const MeanResponses& means, bool zero_is_known) {
  // Light (1 + change) makes responses (1 - change): rows of angle and diattenuation of each of the four.
  Eigen::Matrix<double, 8, 9> jacobian;
  for (Eigen::Index angle = 0; angle < 4; ++angle) {
    const auto shape = ShapeJacobian(means.row(angle));
    for (Eigen::Index row = 0; row < 3; ++row)
      for (Eigen::Index column = 0; column < 3; ++column)
        jacobian.block<2, 1>(2 * angle, 3 * row + column) = -means(angle, row) * shape.col(column);
  }
  if (!zero_is_known) {
    const Eigen::Matrix<double, 1, 9> mean =
        (jacobian.row(0) + jacobian.row(2) + jacobian.row(4) + jacobian.row(6)) / 4;
    for (Eigen::Index angle = 0; angle < 4; ++angle) jacobian.row(2 * angle) -= mean;
  }
  const Eigen::Matrix<double, 8, 8> all = jacobian * covariance * jacobian.transpose();
  std::array<ResponseDeviation, 4> deviations;
  for (Eigen::Index angle = 0; angle < 4; ++angle)
    deviations[std::size_t(angle)] = DeviationOf(all.block<2, 2>(2 * angle, 2 * angle));
  return deviations;
}

}  // namespace polarscan
