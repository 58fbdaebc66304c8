// SPDX-License-Identifier: Apache-2.0
#include "demosaic/sensor/sensor.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/parallel.h"

namespace polarscan {
namespace {

// Row by row: 1 where `in` is not 0 within `reach` pixels to the left or right.
void GrowRow(const std::uint8_t* in, int width, int reach, std::uint8_t* out) {
  int last = -reach - 1;  // the last set pixel seen
  for (int x = 0; x < width + reach; ++x) {
    if (x < width && in[x]) last = x;
    if (x >= reach) out[x - reach] = x - 2 * reach <= last ? 1 : 0;
  }
}

using Histogram = std::span<const std::uint64_t>;

constexpr double kFewestToPile = 4096;
constexpr double kLowestPile = 0.125, kLowestBroadPile = 0.9;  // of the range
constexpr double kSmallestPile = 2e-4, kHotPixels = 2e-5;      // shares of all samples
constexpr int kNarrowPiles = 1024, kBroadPiles = 128;          // in the range

// Samples with counts from `from` on, below `to`.
double CountIn(Histogram histogram, double from, double to) {
  double sum = 0;
  const auto end = std::size_t(std::clamp(to, 0.0, double(histogram.size())));
  for (auto n = std::size_t(std::max(0.0, from)); n < end; ++n) sum += double(histogram[n]);
  return sum;
}

// The highest count that is more than hot pixels'.
double HighestCount(Histogram histogram, double samples) {
  double above = 0;
  std::size_t n = histogram.size();
  while (n > 0 && above <= kHotPixels * samples) above += double(histogram[--n]);
  return double(n);
}

// Samples that were cut off have the same count, or nearly: more than three times as many as lie in as much
// of the range directly below. Light alone, with its noise, thins out towards its brightest; where there is
// nothing below, there is no noise, and the peak is an even area of a made-up picture.
std::optional<double> NarrowPile(Histogram histogram, const Sensor& sensor, double samples, double highest) {
  constexpr int kBelow = 8;
  const double width = std::max(1.0, std::floor(sensor.RangeDn() / kNarrowPiles));
  const double from = highest + 1 - width, pile = CountIn(histogram, from, highest + 1);
  const double below = CountIn(histogram, from - kBelow * width, from) / kBelow;
  if (highest < sensor.black_dn + kLowestPile * sensor.RangeDn()) return std::nullopt;
  return below > 0 && pile > kSmallestPile * samples && pile > 3 * below ? std::optional(from) : std::nullopt;
}

// Pixels that saturate each at its own count, or noise that comes after the cut: the highest peak near the
// end, with five times as many samples as lie in as much of the range below.
std::optional<double> BroadPile(Histogram histogram, const Sensor& sensor, double samples) {
  const double bin = std::max(1.0, std::floor(sensor.RangeDn() / kBroadPiles));
  const double lowest = sensor.black_dn + kLowestBroadPile * sensor.RangeDn();
  const auto in_bin = [&](double from) { return CountIn(histogram, from, from + bin); };
  double peak = lowest;
  for (double at = lowest; at + bin <= sensor.white_dn; at += bin)
    if (in_bin(at) > in_bin(peak)) peak = at;
  double from = peak;
  while (from > lowest && in_bin(from - bin) > in_bin(peak) / 8) from -= bin;
  if (from <= lowest) return std::nullopt;  // it reaches down to where light is as likely
  const double pile = CountIn(histogram, from, sensor.white_dn);
  const double below = CountIn(histogram, 2 * from - bin - sensor.white_dn, from - bin);
  return below > 0 && pile > kSmallestPile * samples && pile > 5 * below ? std::optional(from) : std::nullopt;
}

}  // namespace

double Sensor::QuantizationNoise() const { return bits >= 32 ? 0 : 1 / std::sqrt(12.0) / RangeDn(); }

nlohmann::json ToJson(const Sensor& sensor) {
  return {{"layout", ToString(sensor.layout)},   {"bits", sensor.bits},   {"black_dn", sensor.black_dn},
          {"white_dn", sensor.white_dn},         {"clips", sensor.clips}, {"dn_per_e", sensor.dn_per_e},
          {"read_noise_e", sensor.read_noise_e}, {"gamma", sensor.gamma}};
}

Image<float> ToLight(const Image<float>& counts, const Sensor& sensor) {
  Image<float> light(counts.width(), counts.height());
  const float black = float(sensor.black_dn), scale = float(1 / sensor.RangeDn()),
              gamma = float(sensor.gamma);
  ParallelFor(0, counts.height(), [&](int y) {
    const float* in = counts.row(y);
    float* out = light.row(y);
    for (int x = 0; x < counts.width(); ++x) {
      const float value = (in[x] - black) * scale;
      out[x] = gamma == 1 ? value : std::copysign(std::pow(std::abs(value), gamma), value);
    }
  });
  return light;
}

Image<float> ToLight(const Image<float>& counts, const Sensor& sensor, const Image<float>& black_dn) {
  if (black_dn.empty()) return ToLight(counts, sensor);
  Image<float> light(counts.width(), counts.height());
  const float scale = float(1 / sensor.RangeDn());
  ParallelFor(0, counts.height(), [&](int y) {
    for (int x = 0; x < counts.width(); ++x) light(x, y) = (counts(x, y) - black_dn(x, y)) * scale;
  });
  return light;
}

double SaturationLevel(Histogram histogram, const Sensor& sensor) {
  const double samples = CountIn(histogram, 0, double(histogram.size()));
  if (!sensor.clips || samples < kFewestToPile) return sensor.white_dn;
  const double highest = HighestCount(histogram, samples);
  std::optional<double> pile;
  if (highest < sensor.white_dn) pile = NarrowPile(histogram, sensor, samples, highest);
  if (!pile) pile = BroadPile(histogram, sensor, samples);
  return pile.value_or(sensor.white_dn);
}

void AddToHistogram(const Image<float>& counts, std::vector<std::uint64_t>& histogram) {
  constexpr float kMost = 65535;
  histogram.resize(std::size_t(kMost) + 1);
  for (const float count : counts.pixels()) ++histogram[std::size_t(std::clamp(count, 0.0f, kMost))];
}

Image<std::uint8_t> Clipped(const Image<float>& counts, const Sensor& sensor) {
  Image<std::uint8_t> clipped(counts.width(), counts.height());
  if (!sensor.clips) return clipped;
  const float white = float(sensor.white_dn);
  ParallelFor(0, counts.height(), [&](int y) {
    for (int x = 0; x < counts.width(); ++x) clipped(x, y) = counts(x, y) >= white ? 1 : 0;
  });
  return clipped;
}

Image<std::uint8_t> Grown(Image<std::uint8_t> marks, int reach) {
  const int width = marks.width(), height = marks.height();
  Image<std::uint8_t> rows(width, height);
  ParallelFor(0, height, [&](int y) { GrowRow(marks.row(y), width, reach, rows.row(y)); });
  ParallelFor(0, height, [&](int y) {
    std::fill_n(marks.row(y), width, std::uint8_t(0));
    for (int k = std::max(0, y - reach); k <= std::min(height - 1, y + reach); ++k)
      for (int x = 0; x < width; ++x) marks(x, y) |= rows(x, k);
  });
  return marks;
}

}  // namespace polarscan
