// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/image.h"

namespace polarscan {

// The mean of the four angles (S0 / 2) at every pixel, not blurred across edges: the guide of Morimatsu,
// Monno, Tanaka, Okutomi, Monochrome and color polarization demosaicking using edge-aware residual
// interpolation (ICIP 2020), section 2. Each of the four sides of a pixel gives a mean over its two nearest
// rows (columns), weights 1/8 1/4 1/8, which holds every angle once, and a measure of the edges there: a
// mixed second difference, blind to constant polarization, averaged over 5x3 places. The guide is the mean of
// the four, weighted by 1 / (edges + 1e-4). Any 2x2 layout. Looks 3 px far. `samples` is light in units of
// full scale.
Image<float> EdgeAwareGuide(const Image<float>& samples);

}  // namespace polarscan
