// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <vector>

#include "bench/ground_truth.h"
#include "demosaic/methods/linear.h"

namespace polarscan::bench {

// Sums of a least-squares problem: features x features, features x target.
struct Normal {
  Eigen::MatrixXd xx;
  Eigen::VectorXd xy;

  Normal& operator+=(const Normal& other);
};

// What the kernels of demosaic/methods/linear.h are fitted from: the sums over planes of ground truth. Planes
// of different scenes are added up, or left out, before they are solved. S0 counts each plane by the inverse
// of bilinear interpolation's squared error, as the mean of PSNRs does; S1 and S2 each pixel by 1 / (S0 +
// 0.05), towards the error of the degree of polarization.
struct KernelSums {
  Normal across_s0, across_carrier;  // one carrier: the other is its transpose
  Normal in_row_s0, in_row_first, in_row_second;
  Normal sharpen;

  KernelSums& operator+=(const KernelSums& other);
};

// Of one plane of ground truth.
KernelSums SumPlane(const AnglePlanes& truth);

// The kernels that fit best under the conditions on their gain (linear.h).
LinearKernels Solve(const KernelSums& sums);

}  // namespace polarscan::bench
