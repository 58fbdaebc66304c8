// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>

#include "demosaic/calibration/polarizer/light_refinement.h"
#include "demosaic/calibration/polarizer/polarizer_light.h"

namespace polarscan {

// Variance of a reading as a function of its light, in light: read noise and shot noise, as they show in
// the readings.
struct SampleNoise {
  double constant = 0, per_light = 0;

  double Variance(double light) const { return constant + per_light * (light > 0 ? light : 0); }
};

// Weighted least squares: the responses (N x 3) of all pixels to light (3 x K). weights: 4 x K, of the
// pixels at 0, 45, 90 and 135 degrees.
Eigen::MatrixX3d FitResponses(const PolarizerReadings& readings, const Eigen::Matrix3Xd& stokes,
                              const Eigen::Matrix4Xd& weights);
// All readings count the same.
Eigen::MatrixX3d FitResponses(const PolarizerReadings& readings, const Eigen::Matrix3Xd& stokes);

// Mean responses of the pixels at 0, 45, 90 and 135 degrees.
using MeanResponses = Eigen::Matrix<double, 4, 3>;
MeanResponses MeansByAngle(const PolarizerReadings& readings, const Eigen::MatrixX3d& responses);

// What readings count: the inverse of their variance where pixels are like the mean of their angle's, 4 x
// K, 1 in the mean. Weights do not look at the reading itself, so they do not bias what is made of it.
Eigen::Matrix4Xd WeightsOf(const SampleNoise& noise, const MeanResponses& means,
                           const Eigen::Matrix3Xd& stokes);

// Responses, and the noise that makes them the most likely ones.
struct WeighedFit {
  MeanResponses means = MeanResponses::Zero();
  Eigen::Matrix4Xd weights;
  SampleNoise noise;
};

// By turns: the line of the readings' squared distances from the fit over the light that it expects
// (Janesick, Photon Transfer, 2007), weighted by what such squares scatter; and the fit with the weights
// that follow. (Distances from a fit without weights would not do: what bright readings miss shows in the
// dark ones.)
WeighedFit WeighByNoise(const PolarizerReadings& readings, const Eigen::Matrix3Xd& stokes);

// Standard deviations of a pixel's angle and diattenuation by the noise.
std::array<ResponseDeviation, 4> DeviationsByNoise(const WeighedFit& fit, const Eigen::Matrix3Xd& stokes);

// The same by the light's covariance (RefinedLight). zero_is_known: angles do not count from their mean.
std::array<ResponseDeviation, 4> DeviationsByLight(const Eigen::Matrix<double, 9, 9>& covariance,
                                                   const MeanResponses& means, bool zero_is_known);

}  // namespace polarscan
