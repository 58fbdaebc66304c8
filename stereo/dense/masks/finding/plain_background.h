// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>

#include "core/image.h"
#include "demosaic/stokes.h"

namespace polarscan {

// The object in a picture whose background is plain: black cloth, a sheet of paper, a lit wall. The background is what a
// smooth surface (S0, S1 and S2 as polynomials of second degree in x and y) through the picture's border explains; the
// object is what differs from it. Its outline runs where the light changes most (outline_cut.h). 255 = object. Holes that
// look like the background and are larger than specks stay holes.
// None: the border is not plain (it has texture, or the object fills more than a fifth of it), or nothing stands out of it.
std::optional<Image<std::uint8_t>> ObjectBeforePlainBackground(const StokesImage& light);

}  // namespace polarscan
