// SPDX-License-Identifier: Apache-2.0
#include "acquisition/live_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "acquisition/session/session_views.h"

namespace polarscan {
namespace {

constexpr std::size_t kCounts = 65536;  // values of a sample
constexpr double kClippedTooMuch = 0.002, kTooDark = 0.03;

// The four samples of a cell by angle: 0, 45, 90, 135.
std::array<std::uint16_t, 4> CellAt(const Image<std::uint16_t>& counts, const Layout& layout, int x, int y) {
  std::array<std::uint16_t, 4> cell{};
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
double Sharpness(const Image<std::uint16_t>& counts, double black) {
  const int width = counts.width() / 2, height = counts.height() / 2, reach = 256;
  double edges = 0, power = 0;
  for (int y = std::max(1, height / 2 - reach); y < std::min(height - 1, height / 2 + reach); ++y)
    for (int x = std::max(1, width / 2 - reach); x < std::min(width - 1, width / 2 + reach); ++x) {
      const double centre = S0At(counts, x, y);
      const double laplacian = 4 * centre - S0At(counts, x - 1, y) - S0At(counts, x + 1, y) -
                               S0At(counts, x, y - 1) - S0At(counts, x, y + 1);
      edges += laplacian * laplacian;
      power += (centre - 2 * black) * (centre - 2 * black);
    }
  return power > 0 ? 1000 * edges / power : 0;
}

// clipped_dn: the count from which on a sample is.
StokesImage SmallStokes(const Image<std::uint16_t>& counts, const Sensor& sensor, double clipped_dn,
                        int largest_side) {
  const int cells = std::max(counts.width(), counts.height()) / 2;
  const int step = std::max(1, (cells + largest_side - 1) / largest_side);
  const int width = std::max(1, counts.width() / 2 / step), height = std::max(1, counts.height() / 2 / step);
  const float range = float(sensor.RangeDn()), infinite = std::numeric_limits<float>::infinity();
  StokesImage small{Image<float>(width, height), Image<float>(width, height), Image<float>(width, height),
                    Image<float>(width, height)};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto cell = CellAt(counts, sensor.layout, x * step, y * step);
      const auto [i0, i45, i90, i135] = cell;
      small.s0(x, y) = (0.5f * float(i0 + i45 + i90 + i135) - 2 * float(sensor.black_dn)) / range;
      small.s1(x, y) = float(i0 - i90) / range;
      small.s2(x, y) = float(i45 - i135) / range;
      small.noise(x, y) = double(std::ranges::max(cell)) >= clipped_dn ? infinite : 0;
    }
  return small;
}

// The count from which on samples are saturated. Where nearly all have one count, or lie in the last tenth of
// the range, the whole picture is: a camera's picture of anything else has noise and shade.
std::size_t SaturatedFrom(const std::vector<std::uint64_t>& histogram, const Sensor& sensor) {
  constexpr double kNearlyAll = 0.9, kBright = 0.9, kNotDark = 0.125;  // shares of the samples, of the range
  const auto at = [&](double share) {
    const double count = std::ceil(sensor.black_dn + share * sensor.RangeDn());
    return std::size_t(std::clamp(count, 0.0, kCounts - 1.0));
  };
  const auto total = [&](std::size_t from, std::size_t end) {
    return std::accumulate(histogram.begin() + std::ptrdiff_t(from), histogram.begin() + std::ptrdiff_t(end),
                           0.0);
  };
  const double samples = total(0, kCounts);
  const auto commonest = std::size_t(std::ranges::max_element(histogram) - histogram.begin());
  if (commonest > at(kNotDark) && double(histogram[commonest]) > kNearlyAll * samples) return commonest;
  if (total(at(kBright), kCounts) > kNearlyAll * samples) return at(kBright);
  return std::size_t(std::ceil(std::clamp(SaturationLevel(histogram, sensor), 0.0, kCounts - 1.0)));
}

}  // namespace

LivePicture LookAt(const Frame& frame, const Sensor& sensor, int largest_side) {
  const Image<std::uint16_t> counts = Counts(frame);
  LivePicture view;
  std::array<std::vector<std::uint64_t>, 4> by_angle;
  by_angle.fill(std::vector<std::uint64_t>(kCounts));
  double sum = 0;
  for (int y = 0; y + 1 < counts.height(); y += 2)
    for (int x = 0; x + 1 < counts.width(); x += 2) {
      const auto cell = CellAt(counts, sensor.layout, x / 2, y / 2);
      for (std::size_t a = 0; a < 4; ++a) {
        ++by_angle[a][cell[a]];
        sum += cell[a];
      }
    }
  std::vector<std::uint64_t> all(kCounts);
  for (const auto& histogram : by_angle)
    for (std::size_t n = 0; n < kCounts; ++n) all[n] += histogram[n];
  const std::size_t clipped_dn = SaturatedFrom(all, sensor);
  const double cells = std::max(1.0, double(counts.width() / 2) * (counts.height() / 2));
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t n = clipped_dn; n < kCounts; ++n) view.clipped[a] += double(by_angle[a][n]) / cells;
  view.level = (sum / (4 * cells) - sensor.black_dn) / sensor.RangeDn();
  view.sharpness = Sharpness(counts, sensor.black_dn);
  view.stokes = SmallStokes(counts, sensor, double(clipped_dn), largest_side);
  return view;
}

std::map<std::string, std::string> Advice(const LivePicture& view) {
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
