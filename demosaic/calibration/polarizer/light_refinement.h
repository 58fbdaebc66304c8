// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <vector>

#include "demosaic/calibration/polarizer/polarizer_light.h"

namespace polarscan {

// The light of a space of frames as likely as can be.
struct RefinedLight {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();  // light = matrix * space; mean brightness about 1
  // Of the relative change of the matrix, row by row (matrix = (1 + change) * matrix): from what the frames
  // miss their polarizer's degree, angles or brightness by. Without scale, and turn where angles are
  // unknown.
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
  std::vector<FrameDoubt>
      doubts;  // of indices into these frames, without names; they had no say in the matrix
};

// Maximum-likelihood refinement of LightByAlgebra. Each frame misses the polarizer's degree, and its given
// angle or, if angles are unknown, the mean brightness, by normal errors; their two standard deviations are
// found as well (variance components: degree takes 5 of the 8 unknowns, the other kind 3).
// Levenberg-Marquardt (ceres::TinySolver) on the 3x3 matrix. First with a robust cost (Cauchy), from that
// start of all frames and all but one that fits most frames best; then without the frames that miss by more
// than 5 deviations (at most one in 10, the worst; if more miss by more than 20, the robust cost's result
// stays). Fewer than 9 frames all count. space: 3 x K. Throws Error as LightByAlgebra does.
RefinedLight RefineLight(const Eigen::Matrix3Xd& space, const PolarizerKnowledge& known);

// How many of so many frames may be left out: one in 10, at least one; of fewer than 9 none.
int MostDoubts(Eigen::Index frames);

}  // namespace polarscan
