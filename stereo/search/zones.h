// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

namespace polarscan {

struct Offset {
  int dx, dy;
};

// Where a pixel of a checkerboard looks for hypotheses (ACMH: Xu and Tao, CVPR 2019): eight zones of pixels of
// the other colour, up, down, left, right, each direction a V of seven pixels, then a far strip of eleven. The
// first pixel of each V is the one beside.
std::vector<std::vector<Offset>> MakeZones();

}  // namespace polarscan
