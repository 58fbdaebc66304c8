// SPDX-License-Identifier: Apache-2.0
#include "evaluation/output/pictures.h"

#include <cmath>

#include "demosaic/false_colour.h"

namespace polarscan {

Image<Rgb8> ErrorPicture(const Image<float>& errors, double limit) {
  static constexpr Rgb8 kMissing{47, 111, 214};
  const Palette heat = HeatPalette();
  Image<Rgb8> picture(errors.width(), errors.height(), kNoData);
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const float error = errors.pixels()[i];
    if (std::isnan(error)) continue;
    picture.pixels()[i] = std::isinf(error) ? kMissing : ColourAt(heat, float(error / limit));
  }
  return picture;
}

}  // namespace polarscan
