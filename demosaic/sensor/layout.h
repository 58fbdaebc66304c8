// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <string>

namespace polarscan {

// Where the polarizers (and colour filters) sit on the sensor.
// angles_deg: polarizer angles of the 2x2 cell, row by row from the top-left pixel; a permutation of 0, 45,
// 90, 135, counted anticlockwise as displayed from +x (docs/conventions.md). A camera that counts the other
// way is declared by swapping 45 and 135. bayer: "" for mono; else the colours of the 2x2 blocks ("rggb",
// "bggr", "grbg", "gbrg"): a colour sensor's cell is 4x4, four blocks of one colour each, every block holding
// the 2x2 polarizer cell.
struct Layout {
  std::array<int, 4> angles_deg = {90, 45, 135, 0};
  std::string bayer;

  int AngleAt(int x, int y) const { return angles_deg[std::size_t((y & 1) * 2 + (x & 1))]; }
  // 'r', 'g' or 'b'; 'm' on a mono sensor.
  char ColourAt(int x, int y) const {
    return bayer.empty() ? 'm' : bayer[std::size_t(((y >> 1) & 1) * 2 + ((x >> 1) & 1))];
  }
  bool operator==(const Layout&) const = default;
};

// "90 45 / 135 0", "90,45,135,0" and the like; with a colour word for colour sensors: "90 45 / 135 0 rggb".
// Throws Error on anything else, naming the text and showing a right one.
Layout ParseLayout(const std::string& text);
std::string ToString(const Layout& layout);

}  // namespace polarscan
