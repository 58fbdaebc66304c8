// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "demosaic/method.h"

namespace polarscan {

// Fitted linear demosaicing: fixed 7x7 kernels on the mosaic, which reach all of the 8x8 px around each 2x2
// cell.
//
// A mosaic M is 2 M = S0 + sum over the carriers k of k(x, y) Q_k, with k = (-1)^y, (-1)^x, (-1)^(x+y) and
// Q_k a mixture of S1 and S2 that depends on the layout; one of the three Q is 0 (docs/demosaic.md). So one
// kernel for S0 and one for each of the two Q serve every pixel of every layout that has its orthogonal
// polarizers in the same places. Kernels are even in x and y. Their gain is 1 for what they want and 0 for
// the other two: constant light comes back exactly.
struct LinearKernels {
  using Kernel = std::array<float, 16>;  // taps at (|x|, |y|): [4 |y| + |x|]
  struct Set {
    Kernel s0{}, first{}, second{};  // of 2 M
  };
  // Orthogonal polarizers across the cell (90 45 / 135 0): carriers (-1)^y, (-1)^x.
  // In the same row (0 90 / 45 135): carriers (-1)^x, (-1)^(x+y). In the same column: that one transposed.
  Set across, in_row;
  // S0 of the method `sharp` (sharp.h): taps on 2 M and, at most 1 px away, on S0.
  Kernel sharpen_mosaic{}, sharpen_s0{};
};

// Fitted by bench/fit_kernels on all of the ground truth that docs/demosaic.md names: linear_kernels.inc.
const LinearKernels& FittedKernels();

// I0 + I90 - I45 - I135, which the kernels do not see, is what bilinear interpolation gives.
AnglePlanes FillByKernels(const Image<float>& samples, const Layout& layout, const LinearKernels& kernels);
std::vector<AnglePlanes> InterpolateLinear(const Image<float>& samples, const Layout& layout);

// An even 7x7 kernel on a picture, reflected at the border.
Image<float> Convolve(const Image<float>& image, const LinearKernels::Kernel& kernel);

// Where the carriers of a layout lie and what they carry: Q = q1 S1 + q2 S2. Two, in the order of the
// kernels.
struct Carrier {
  bool row = false, column = false;  // (-1)^y, (-1)^x; both: (-1)^(x+y)
  float q1 = 0, q2 = 0;

  float SignAt(int x, int y) const { return ((row && (y & 1)) != (column && (x & 1))) ? -1.f : 1.f; }
};
std::array<Carrier, 2> Carriers(const Layout& layout);
// The kernels for carriers in this order.
LinearKernels::Set KernelsFor(const std::array<Carrier, 2>& carriers, const LinearKernels& kernels);

}  // namespace polarscan
