// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "demosaic/method.h"

namespace polarscan {

// Difference interpolation: what an angle's samples differ from the edge-aware guide (guide.h) is smooth, so
// that is interpolated bilinearly and the guide added. Looks 4 px far.
std::vector<AnglePlanes> InterpolateDifference(const Image<float>& samples, const Layout& layout);

}  // namespace polarscan
