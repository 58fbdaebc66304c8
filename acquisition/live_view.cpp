// SPDX-License-Identifier: Apache-2.0
#include "acquisition/live_view.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/session/session_views.h"

namespace polarscan {
namespace {

constexpr double kClippedTooMuch = 0.002, kTooDark = 0.03;

// The four samples of a cell by angle: 0, 45, 90, 135.
std::array<float, 4> CellAt(const Image<std::uint16_t>& counts, const Layout& layout, int x, int y) {
  std::array<float, 4> cell{};
  for (int dy = 0; dy < 2; ++dy)
    for (int dx = 0; dx < 2; ++dx)
      cell[std::size_t(layout.AngleAt(dx, dy) / 45)] = counts(2 * x + dx, 2 * y + dy);
  return cell;
}

float S0At(const Image<std::uint16_t>& counts, int x, int y) {
  return 0.5f * (float(counts(2 * x, 2 * y)) + float(counts(2 * x + 1, 2 * y)) +
                 float(counts(2 * x, 2 * y + 1)) + float(counts(2 * x + 1, 2 * y + 1)));
}

// In the middle of the picture.
double Sharpness(const Image<std::uint16_t>& counts) {
  const int width = counts.width() / 2, height = counts.height() / 2, reach = 256;
  double edges = 0, power = 0;
  for (int y = std::max(1, height / 2 - reach); y < std::min(height - 1, height / 2 + reach); ++y)
    for (int x = std::max(1, width / 2 - reach); x < std::min(width - 1, width / 2 + reach); ++x) {
      const double centre = S0At(counts, x, y);
      const double laplacian = 4 * centre - S0At(counts, x - 1, y) - S0At(counts, x + 1, y) -
                               S0At(counts, x, y - 1) - S0At(counts, x, y + 1);
      edges += laplacian * laplacian;
      power += centre * centre;
    }
  return power > 0 ? 1000 * edges / power : 0;
}

StokesImage SmallStokes(const Image<std::uint16_t>& counts, const Layout& layout, float full_scale,
                        int largest_side) {
  const int cells = std::max(counts.width(), counts.height()) / 2;
  const int step = std::max(1, (cells + largest_side - 1) / largest_side);
  const int width = std::max(1, counts.width() / 2 / step), height = std::max(1, counts.height() / 2 / step);
  StokesImage small{Image<float>(width, height), Image<float>(width, height), Image<float>(width, height),
                    Image<float>(width, height)};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto [i0, i45, i90, i135] = CellAt(counts, layout, x * step, y * step);
      small.s0(x, y) = 0.5f * (i0 + i45 + i90 + i135) / full_scale;
      small.s1(x, y) = (i0 - i90) / full_scale;
      small.s2(x, y) = (i45 - i135) / full_scale;
      small.noise(x, y) = 0;
    }
  return small;
}

}  // namespace

LiveView LookAt(const Frame& frame, const Layout& layout, int bits, int largest_side) {
  const Image<std::uint16_t> counts = Counts(frame);
  const int full = (1 << bits) - 1;
  LiveView view;
  view.clipped.fill(0);
  double sum = 0;
  for (int y = 0; y + 1 < counts.height(); y += 2)
    for (int x = 0; x + 1 < counts.width(); x += 2)
      for (int dy = 0; dy < 2; ++dy)
        for (int dx = 0; dx < 2; ++dx) {
          const int sample = counts(x + dx, y + dy);
          view.clipped[std::size_t(layout.AngleAt(dx, dy) / 45)] += sample >= full;
          sum += sample;
        }
  const double cells = double(counts.width() / 2) * (counts.height() / 2);
  for (double& share : view.clipped) share /= std::max(1.0, cells);
  view.level = sum / std::max(1.0, 4 * cells) / full;
  view.sharpness = Sharpness(counts);
  view.stokes = SmallStokes(counts, layout, float(full), largest_side);
  return view;
}

std::map<std::string, std::string> Advice(const LiveView& view) {
  std::map<std::string, std::string> advice;
  const double most = *std::ranges::max_element(view.clipped);
  if (most > kClippedTooMuch)
    advice["clipped"] =
        fmt::format("{:.1f} % of the samples behind one polarizer are clipped: less exposure", 100 * most);
  if (view.level < kTooDark && most <= kClippedTooMuch)
    advice["dark"] = fmt::format("the picture is dark, {:.1f} % of full scale on average: more exposure",
                                 100 * view.level);
  return advice;
}

}  // namespace polarscan
