// SPDX-License-Identifier: Apache-2.0
#include "stereo/contours/fill.h"

#include <algorithm>

namespace polarscan {
namespace {

// Weighted means of 2x2 pixels; a mean counts as its pixels together, but no more than 1.
Distances HalfSize(const Distances& fine) {
  const int width = (fine.u.width() + 1) / 2, height = (fine.u.height() + 1) / 2;
  Distances half{Image<float>(width, height), Image<float>(width, height)};
  for (int y = 0; y < fine.u.height(); ++y)
    for (int x = 0; x < fine.u.width(); ++x) {
      half.u(x / 2, y / 2) += fine.weight(x, y) * fine.u(x, y);
      half.weight(x / 2, y / 2) += fine.weight(x, y);
    }
  for (std::size_t i = 0; i < half.u.size(); ++i) {
    float& weight = half.weight.pixels()[i];
    if (weight > 0) half.u.pixels()[i] /= weight;
    weight = std::min(weight, 1.0f);
  }
  return half;
}

// Of a half-size image at a fine pixel, borders repeated.
float BetweenHalf(const Image<float>& half, int x, int y) {
  const int left = x / 2, top = y / 2;
  const int right = std::clamp(left + (x % 2 ? 1 : -1), 0, half.width() - 1),
            below = std::clamp(top + (y % 2 ? 1 : -1), 0, half.height() - 1);
  return 0.75f * (0.75f * half(left, top) + 0.25f * half(right, top)) +
         0.25f * (0.75f * half(left, below) + 0.25f * half(right, below));
}

}  // namespace

Image<float> FillFromCoarse(const Distances& given) {
  if (given.u.width() <= 1 && given.u.height() <= 1) return given.u;
  const Image<float> coarse = FillFromCoarse(HalfSize(given));
  Image<float> filled(given.u.width(), given.u.height());
  for (int y = 0; y < filled.height(); ++y)
    for (int x = 0; x < filled.width(); ++x) {
      const float share = std::min(given.weight(x, y), 1.0f);
      filled(x, y) = share * given.u(x, y) + (1 - share) * BetweenHalf(coarse, x, y);
    }
  return filled;
}

}  // namespace polarscan
