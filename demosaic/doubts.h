// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "demosaic/polar_view.h"

namespace polarscan {

// What no light can be, of a view that was misread: shares of its pixels, in the mask if there is one.
struct ViewDoubts {
  double without_light = 0;  // S0 is certainly below 0, or no number
  double impossible = 0;     // certainly more polarized light than light (DoP above 1), of those with light
  double clipped = 0;        // nothing is known: clipped, or no number
  double imbalance = 0;      // of four angles, of those with light: median of (I0 + I90 - I45 - I135) / S0
};
ViewDoubts DoubtsOf(const PolarView& view, const Image<std::uint8_t>& mask);

}  // namespace polarscan
