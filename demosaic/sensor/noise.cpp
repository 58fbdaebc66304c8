// SPDX-License-Identifier: Apache-2.0
#include "demosaic/sensor/noise.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "core/statistics.h"

namespace polarscan {
namespace {

constexpr double kMedianOfNormal = 0.67449;  // median of |x| for a standard normal x
constexpr int kBlock = 16;                   // px
constexpr std::size_t kFewestInBlock = 64, kSmallestBin = 16, kMostBins = 16, kFewestBlocks = 4;
constexpr double kMostSamples = 400e3;
// Texture adds to what looks like noise, and nothing takes away from it: the quiet blocks of a brightness
// tell. Where there is noise alone, they lie lower than the mean by a factor (measured, noise_test).
constexpr double kQuiet = 0.1, kQuietLower = 0.89;

// Mean intensity and variance of an intensity sample, in a block or in a bin of blocks.
struct Level {
  double level, variance;
};

// [1 -2 1] x [1 -2 1] at distance `lag`: blind to anything that bends along x or y alone (edges), and 6 times
// the noise of one pixel (Immerkaer, Fast noise variance estimation, 1996).
float MixedDifference(const Image<float>& image, int x, int y, int lag) {
  const auto row = [&](int v) { return image(x - lag, v) - 2 * image(x, v) + image(x + lag, v); };
  return row(y - lag) - 2 * row(y) + row(y + lag);
}

bool AllValid(const StokesImage& image, int x, int y, int lag) {
  const auto valid = [&](int u, int v) { return std::isfinite(image.noise(u, v)) && image.s0(u, v) > 0; };
  for (int v = y - lag; v <= y + lag; v += lag)
    for (int u = x - lag; u <= x + lag; u += lag)
      if (!valid(u, v)) return false;
  return true;
}

// Standard deviation of normal values with mean 0, from the median of their size.
double RobustSigma(std::vector<float>& values) {
  for (float& value : values) value = std::abs(value);
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle / kMedianOfNormal;
}

// The share of S0 that the redundancy is on the whole: gains of the four angles that differ; 0 if small.
float Imbalance(const StokesImage& image, const Image<float>& redundancy) {
  constexpr float kSmall = 0.01f;
  constexpr std::size_t kEvery = 7, kEnough = 1000;
  if (redundancy.empty()) return 0;
  std::vector<float> levels, shares;
  for (std::size_t i = 0; i < redundancy.size(); i += kEvery)
    if (std::isfinite(image.noise.pixels()[i])) levels.push_back(image.s0.pixels()[i]);
  if (levels.size() < kEnough) return 0;
  const float bright = Quantile(std::move(levels), 0.75);
  for (std::size_t i = 0; i < redundancy.size(); i += kEvery)
    if (std::isfinite(image.noise.pixels()[i]) && image.s0.pixels()[i] > 0 && image.s0.pixels()[i] >= bright)
      shares.push_back(redundancy.pixels()[i] / image.s0.pixels()[i]);
  const float middle = Quantile(std::move(shares), 0.5);
  return std::abs(middle) > kSmall ? middle : 0;
}

// Nothing if too few pixels are valid; black background (S0 = 0) tells nothing and is left out.
std::optional<Level> MeasureBlock(const StokesImage& image, const Image<float>& redundancy, float imbalance,
                                  int lag, int x0, int y0) {
  std::vector<float> levels, sums, differences;
  for (int y = y0; y < y0 + kBlock; ++y)
    for (int x = x0; x < x0 + kBlock; ++x) {
      if (!AllValid(image, x, y, lag)) continue;
      levels.push_back(image.s0(x, y) / 2);
      sums.push_back(redundancy.empty() ? 0 : redundancy(x, y) - imbalance * image.s0(x, y));
      differences.push_back(MixedDifference(image.s1, x, y, lag));
      differences.push_back(MixedDifference(image.s2, x, y, lag));
    }
  if (levels.size() < kFewestInBlock) return std::nullopt;
  const double sigma = std::max(RobustSigma(sums) / 2, RobustSigma(differences) / std::sqrt(72.0));
  std::ranges::nth_element(levels, levels.begin() + std::ptrdiff_t(levels.size() / 2));
  return Level{levels[levels.size() / 2], sigma * sigma};
}

// Blocks on a regular grid.
std::vector<Level> MeasureBlocks(const StokesImage& image, const Image<float>& redundancy, int lag) {
  const int width = image.s0.width(), height = image.s0.height();
  const int every = kBlock * std::max(1, int(std::sqrt(double(width) * height / kMostSamples)));
  const float imbalance = Imbalance(image, redundancy);
  std::vector<Level> blocks;
  for (int y = lag; y + kBlock <= height - lag; y += every)
    for (int x = lag; x + kBlock <= width - lag; x += every)
      if (const auto block = MeasureBlock(image, redundancy, imbalance, lag, x, y)) blocks.push_back(*block);
  return blocks;
}

std::vector<Level> MeasureBins(std::vector<Level> blocks) {
  std::ranges::sort(blocks, {}, &Level::level);
  const std::size_t count = std::clamp<std::size_t>(blocks.size() / kSmallestBin, 1, kMostBins);
  std::vector<Level> bins;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t first = i * blocks.size() / count, last = (i + 1) * blocks.size() / count;
    const std::span<Level> bin = std::span(blocks).subspan(first, last - first);
    const double level = bin[bin.size() / 2].level;
    const auto quiet = bin.begin() + std::ptrdiff_t(kQuiet * double(bin.size()));
    std::ranges::nth_element(bin, quiet, {}, &Level::variance);
    bins.push_back({level, quiet->variance / (kQuietLower * kQuietLower)});
  }
  return bins;
}

// Least squares with both terms >= 0. Weights between absolute and relative errors, so that neither the
// brightest nor a quiet dark bin decides alone.
NoiseModel FitModel(const std::vector<Level>& bins) {
  double mean = 0, w = 0, wx = 0, wxx = 0, wv = 0, wxv = 0;
  for (const Level& bin : bins) mean += bin.variance / double(bins.size());
  if (mean <= 0) return {};
  for (const auto& [x, v] : bins) {
    const double weight = mean * mean / ((v + mean) * (v + mean));
    w += weight, wx += weight * x, wxx += weight * x * x, wv += weight * v, wxv += weight * x * v;
  }
  const double determinant = w * wxx - wx * wx;
  if (determinant <= 1e-9 * w * wxx) return {wv / w, 0};
  const double per_level = (w * wxv - wx * wv) / determinant, at_zero = (wv - per_level * wx) / w;
  if (per_level < 0) return {wv / w, 0};
  return at_zero < 0 ? NoiseModel{0, wxv / wxx} : NoiseModel{at_zero, per_level};
}

}  // namespace

float NoiseModel::Sigma(float level) const {
  return std::max(1e-6f, float(std::sqrt(at_zero + per_level * std::max(0.0f, level))));
}

NoiseModel SensorNoise(const Sensor& sensor) {
  const double read_dn = sensor.dn_per_e * sensor.read_noise_e, range = sensor.RangeDn();
  const double rounding = sensor.QuantizationNoise();
  return {read_dn * read_dn / (range * range) + rounding * rounding, sensor.dn_per_e / range};
}

NoiseModel EstimateNoise(const StokesImage& image, const Image<float>& redundancy, int lag) {
  std::vector<Level> blocks = MeasureBlocks(image, redundancy, lag);
  return blocks.size() < kFewestBlocks ? NoiseModel() : FitModel(MeasureBins(std::move(blocks)));
}

}  // namespace polarscan
