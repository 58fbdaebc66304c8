// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>

#include "demosaic/calibration/polarizer/polarizer_light.h"

namespace polarscan {

// Ratio of the extreme singular values of light, 3 x K: sqrt(2) for polarizer angles that are spread
// evenly, 1e6 for light that does not span three dimensions.
double ConditionOf(const Eigen::Matrix3Xd& stokes);

// Throws Error if such a condition number of frames is too large to calibrate with.
void RequireSpread(double condition);

// Sums of products of readings between frames, K x K.
Eigen::MatrixXd GramOf(const PolarizerReadings& readings);

// Orthonormal 3 x K: the space of the frames' light, the three strongest components of their Gram matrix.
// Throws Error as RequireSpread does.
Eigen::Matrix3Xd LightSpace(const Eigen::MatrixXd& gram);

// Variance of each frame's readings over the pixels, in light, that is left outside of the space of all
// frames; corrected for the frame's own part in the space, so that equal noise gives equal values.
Eigen::VectorXd LeftOutside(const Eigen::MatrixXd& gram, Eigen::Index pixels);

// The matrix (up to scale, and up to a turn of S1 and S2 if the angles are unknown) that makes light of a
// space, 3 x K, by linear equations (FindPolarizerLight): a start for the refinement. known.angles_deg: of
// these frames. Throws Error if the frames do not look like a polarizer that is turned.
Eigen::Matrix3d LightByAlgebra(const Eigen::Matrix3Xd& space, const PolarizerKnowledge& known);

}  // namespace polarscan
