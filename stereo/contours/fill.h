// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stereo/contours/log_distance.h"

namespace polarscan {

// u for every pixel: what is given, and where nothing is, the mean of what is near, over blocks of 2, 4, 8 ... pixels,
// bilinear between them. Zero everywhere if nothing is given.
Image<float> FillFromCoarse(const Distances& given);

}  // namespace polarscan
