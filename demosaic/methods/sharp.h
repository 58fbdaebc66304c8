// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "demosaic/methods/linear.h"

namespace polarscan {

// The best that this program has (docs/demosaic.md): EARI (residual.h) in two passes with fitted kernels
// between them.
//   1. EARI gives S0, S1, S2.
//   2. Small fitted kernels on the mosaic and on that S0 give a sharper S0.
//   3. Residual interpolation with this S0 / 2 as the guide.
//   4. S0: the mean of 2 and 3. S1, S2: the mean of 1 and 3, whose errors differ.
// Looks 26 px far, weakly beyond 3.
AnglePlanes FillSharp(const Image<float>& samples, const Layout& layout, const LinearKernels& kernels);
std::vector<AnglePlanes> InterpolateSharp(const Image<float>& samples, const Layout& layout);

// S0 of four planes.
Image<float> MeanS0(const AnglePlanes& planes);

}  // namespace polarscan
