// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "demosaic/method.h"

namespace polarscan {

// Bilinear demosaicing: a missing sample is the mean of its nearest same-kind samples (2 in the row or
// column, 4 in the cross or on the diagonals), which equals [1 2 1] x [1 2 1] / 4 on the zero-filled lattice.
// A colour sensor is filled twice: first colours, each polarizer angle being a half-size Bayer picture, then
// angles in each colour. At the border the missing neighbour is replaced by the one on the other side, which
// is of the same kind. A picture linear in x and y comes back exactly inside. Any layout; any size of at
// least 4x4.
std::vector<AnglePlanes> InterpolateBilinear(const Image<float>& samples, const Layout& layout);

// The second half of it: every pixel gets all four angles of a mono mosaic (layout.bayer is not looked at).
AnglePlanes FillAngles(const Image<float>& samples, const Layout& layout);

// Throws Error if a mosaic is smaller than 4x4.
void CheckMosaicSize(const Image<float>& samples);

}  // namespace polarscan
