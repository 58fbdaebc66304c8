// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "core/image.h"
#include "demosaic/sensor/layout.h"
#include "demosaic/stokes.h"

namespace polarscan::test {

struct Stokes {
  double s0 = 0, s1 = 0, s2 = 0;
};

// The light that an ideal polarizer passes (docs/conventions.md).
inline double Behind(const Stokes& s, int angle_deg) {
  const double turn = 2 * angle_deg * std::numbers::pi / 180;
  return (s.s0 + s.s1 * std::cos(turn) + s.s2 * std::sin(turn)) / 2;
}

// What a sensor of this layout sees of a scene; colour is 'r', 'g', 'b' or 'm'.
using Scene = std::function<Stokes(int x, int y, char colour)>;
inline Image<float> TakeMosaic(int width, int height, const Layout& layout, const Scene& scene) {
  Image<float> mosaic(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      mosaic(x, y) = float(Behind(scene(x, y, layout.ColourAt(x, y)), layout.AngleAt(x, y)));
  return mosaic;
}

// Every one of the 24 orders of the four polarizers, with this Bayer order ("" for mono).
inline std::vector<Layout> AllLayouts(const std::string& bayer) {
  std::vector<Layout> layouts;
  std::array<int, 4> angles = {0, 45, 90, 135};
  do layouts.push_back({angles, bayer});
  while (std::next_permutation(angles.begin(), angles.end()));
  return layouts;
}

}  // namespace polarscan::test
