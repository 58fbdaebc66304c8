// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "demosaic/method.h"

namespace polarscan {

// No interpolation: every pixel of a 2x2 cell gets the cell's four samples as they are; on a colour sensor
// every pixel of a 4x4 cell its red and blue and the mean of its two greens. Half (a quarter of) the
// resolution on the full pixel grid; the four angles look at places 1 px apart, which reads as polarization
// along edges. Beyond the last whole cell the last one is repeated.
std::vector<AnglePlanes> RepeatSuperpixels(const Image<float>& samples, const Layout& layout);

}  // namespace polarscan
