// SPDX-License-Identifier: Apache-2.0
#include "demosaic/noise.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace polarscan {
namespace {

constexpr double kMedianOfNormal = 0.67449;  // median of |x| for a standard normal x
constexpr std::size_t kSmallestBin = 200, kMostBins = 16;
constexpr double kMostSamples = 200e3;

// What one pixel tells: its level (mean intensity), its redundancy, the mixed differences of S1 and S2.
struct Sample {
  float level, redundancy, difference1, difference2;
};

struct BinLevel {
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

// A regular grid of valid pixels; black background (S0 = 0) tells nothing and is left out.
std::vector<Sample> TakeSamples(const StokesImage& image, const Image<float>& redundancy, int lag) {
  const int width = image.s0.width(), height = image.s0.height();
  const int stride = std::max(1, int(std::sqrt(double(width) * height / kMostSamples)));
  std::vector<Sample> samples;
  for (int y = lag; y < height - lag; y += stride)
    for (int x = lag; x < width - lag; x += stride) {
      if (!AllValid(image, x, y, lag)) continue;
      samples.push_back({image.s0(x, y) / 2, redundancy.empty() ? 0 : redundancy(x, y),
                         MixedDifference(image.s1, x, y, lag), MixedDifference(image.s2, x, y, lag)});
    }
  return samples;
}

// Standard deviation of normal values with mean 0, from the median of their size.
double RobustSigma(std::vector<float>& values) {
  for (float& value : values) value = std::abs(value);
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle / kMedianOfNormal;
}

BinLevel MeasureBin(std::span<const Sample> bin) {
  std::vector<float> redundancy, differences;
  for (const Sample& sample : bin) {
    redundancy.push_back(sample.redundancy);
    differences.push_back(sample.difference1);
    differences.push_back(sample.difference2);
  }
  const double sigma = std::max(RobustSigma(redundancy) / 2, RobustSigma(differences) / std::sqrt(72.0));
  return {bin[bin.size() / 2].level, sigma * sigma};
}

std::vector<BinLevel> MeasureBins(std::vector<Sample> samples) {
  std::ranges::sort(samples, {}, &Sample::level);
  const std::size_t count = std::min(kMostBins, samples.size() / kSmallestBin);
  std::vector<BinLevel> bins;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t first = i * samples.size() / count, last = (i + 1) * samples.size() / count;
    bins.push_back(MeasureBin(std::span(samples).subspan(first, last - first)));
  }
  return bins;
}

// Least squares with both terms >= 0. Weights between absolute and relative errors, so that neither the
// brightest nor a quiet dark bin decides alone.
NoiseModel FitModel(const std::vector<BinLevel>& bins) {
  double mean = 0, w = 0, wx = 0, wxx = 0, wv = 0, wxv = 0;
  for (const BinLevel& bin : bins) mean += bin.variance / double(bins.size());
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
  return FitModel(MeasureBins(TakeSamples(image, redundancy, lag)));
}

}  // namespace polarscan
