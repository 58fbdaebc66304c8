// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "demosaic/method.h"

namespace polarscan {

// Polarization-difference interpolation with Newton's polynomial (Li, Zhao, Pan, Kong, Chan, Demosaicking
// DoFP images using Newton's polynomial interpolation and polarization difference model, Opt. Express
// 27:1376, 2019). Along a line through a pixel its own angle and the wanted one alternate; their difference
// is taken to be smooth, which gives the taps 1/16 -1/4 7/16 1/2 7/16 -1/4 1/16, the pixel's own angle at the
// even ones. Both diagonals hold the angle opposite in the cell: where one of them is clearly smoother it
// alone is taken, else both, weighted by their smoothness. The two other angles are estimated along the row
// and along the column, the second time from what the diagonals gave, and joined in the same way. Looks 7 px
// far.
std::vector<AnglePlanes> InterpolateNewton(const Image<float>& samples, const Layout& layout);

}  // namespace polarscan
