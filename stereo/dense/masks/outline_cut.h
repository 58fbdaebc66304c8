// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "core/image.h"
#include "stereo/dense/masks/outline_steps.h"

namespace polarscan {

// The mask whose outline runs where the light changes most, near a line: it cuts the grid of pixels at the least
// contrast-weighted length (geodesic active contours by a graph cut: Boykov and Kolmogorov, ICCV 2003), among the
// pixels whose `distance` (px, negative inside, as SignedDistance) is less than band_px. Beyond, the sign decides.
Image<std::uint8_t> CutAlongSteps(const LightSteps& light, const Image<float>& distance, double band_px);

}  // namespace polarscan
