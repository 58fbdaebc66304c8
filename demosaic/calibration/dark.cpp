// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/dark.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr int kFewestDarkFrames = 4;
constexpr double kBrightestDark = 0.25;  // of the white level: more is light
constexpr double kMostOverBlack = 0.1;   // of the range, over the black level that was said
constexpr double kMostUneven = 0.02;     // of the white level, between parts of the picture or polarizers
constexpr int kParts = 8;                // of the picture's shorter side
constexpr double kRoundingVariance = 1.0 / 12;  // variance, DN^2

// Sums over frames, relative to the first one, so that float32 is enough.
class DarkSums {
 public:
  void Add(const Image<float>& counts) {
    if (frames_++ == 0) first_ = counts, sum_ = squares_ = Image<float>(counts.width(), counts.height());
    ParallelFor(0, counts.height(), [&](int y) {
      for (int x = 0; x < counts.width(); ++x) {
        const float d = counts(x, y) - first_(x, y);
        sum_(x, y) += d, squares_(x, y) += d * d;
      }
    });
  }
  Image<float> Mean() const {
    Image<float> mean = first_;
    for (std::size_t i = 0; i < mean.size(); ++i) mean.pixels()[i] += sum_.pixels()[i] / float(frames_);
    return mean;
  }
  // In time; mean over the quieter 99.9 % of the pixels, since a few hot ones flicker.
  double Variance() const {
    std::vector<float> variances(sum_.size());
    for (std::size_t i = 0; i < variances.size(); ++i) {
      const float s = sum_.pixels()[i];
      variances[i] = (squares_.pixels()[i] - s * s / float(frames_)) / float(frames_ - 1);
    }
    const std::size_t count = std::max<std::size_t>(1, variances.size() * 999 / 1000);
    std::ranges::nth_element(variances, variances.begin() + std::ptrdiff_t(count - 1));
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += variances[i];
    return sum / double(count);
  }
  int frames() const { return frames_; }

 private:
  int frames_ = 0;
  Image<float> first_, sum_, squares_;
};

float MedianOfPart(const Image<float>& counts, int x0, int y0, int side) {
  std::vector<float> part;
  for (int y = y0; y < y0 + side; y += 2)
    for (int x = x0; x < x0 + side; x += 2) part.push_back(counts(x, y));
  const auto middle = part.begin() + std::ptrdiff_t(part.size() / 2);
  std::ranges::nth_element(part, middle);
  return *middle;
}

// By how many counts parts of the picture, and the four places of the cell, differ: the most of them, so that
// neither hot pixels nor a glowing corner counts.
double Unevenness(const Image<float>& counts) {
  const int side = std::max(2, std::min(counts.width(), counts.height()) / kParts / 2 * 2);
  std::vector<float> medians;
  for (int y = 0; y + side <= counts.height(); y += side)
    for (int x = 0; x + side <= counts.width(); x += side)
      for (const auto& [dx, dy] : {std::pair(0, 0), std::pair(1, 0), std::pair(0, 1), std::pair(1, 1)})
        medians.push_back(MedianOfPart(counts, x + dx, y + dy, side - 1));
  std::ranges::sort(medians);
  const std::size_t tenth = medians.size() / 10;
  return medians.empty() ? 0 : double(medians[medians.size() - 1 - tenth] - medians[tenth]);
}

void CheckDark(const Image<float>& counts, const Sensor& sensor, const std::string& name) {
  double sum = 0;
  for (const float value : counts.pixels()) sum += value;
  const double mean = sum / double(counts.size()), share = mean / sensor.white_dn;
  const double over = sensor.black_dn > 0 ? (mean - sensor.black_dn) / sensor.RangeDn() : 0;
  const double uneven = Unevenness(counts) / sensor.white_dn;
  const auto refuse = [&](const std::string& why) {
    throw Error("this frame is not dark, " + why, name, "Take dark frames with the lens covered");
  };
  if (share > kBrightestDark) refuse(fmt::format("its mean is {:.0f} % of the white level", 100 * share));
  if (over > kMostOverBlack)
    refuse(
        fmt::format("its mean of {:.0f} DN is far above the black level of {:g} DN", mean, sensor.black_dn));
  if (uneven > kMostUneven)
    refuse(fmt::format("its parts differ by {:.0f} % of the white level", 100 * uneven));
}

double MeanBehind(const Image<float>& values, const Layout& layout, int angle_deg) {
  double sum = 0, count = 0;
  for (int y = 0; y < values.height(); ++y)
    for (int x = 0; x < values.width(); ++x)
      if (layout.AngleAt(x, y) == angle_deg) sum += values(x, y), ++count;
  return count > 0 ? sum / count : 0;
}

}  // namespace

double DrawToMean(Image<float>& values, const Layout& layout, double noise_variance) {
  std::array<double, 4> means{};
  for (std::size_t a = 0; a < 4; ++a) means[a] = MeanBehind(values, layout, 45 * int(a));
  const auto mean = [&](int x, int y) { return means[std::size_t(layout.AngleAt(x, y) / 45)]; };
  double spread = 0;
  for (int y = 0; y < values.height(); ++y)
    for (int x = 0; x < values.width(); ++x)
      spread += std::pow(values(x, y) - mean(x, y), 2) / double(values.size());
  const double truth = std::max(0.0, spread - noise_variance), keep = spread > 0 ? truth / spread : 0;
  for (int y = 0; y < values.height(); ++y)
    for (int x = 0; x < values.width(); ++x)
      values(x, y) = float(mean(x, y) + keep * (values(x, y) - mean(x, y)));
  return std::sqrt(truth);
}

DarkCalibration CalibrateDark(const CalibrationFrames& frames, const Sensor& sensor, Progress& progress) {
  if (frames.size() < kFewestDarkFrames)
    throw Error(
        fmt::format("too few frames: {} where at least {} are needed", frames.size(), kFewestDarkFrames),
        "the dark frames", "Take 16 or more with the lens covered");
  DarkCalibration dark;
  DarkSums sums;
  progress.Begin("dark frames", frames.names.size(), "frame");
  for (int k = 0; k < frames.size(); ++k) {
    progress.Check();
    const Image<float> counts = frames.counts(k);
    CheckDark(counts, sensor, frames.names[std::size_t(k)]);
    dark.at_zero += std::size_t(std::ranges::count(counts.pixels(), 0.0f));
    sums.Add(counts);
    progress.Advance();
  }
  const double variance = sums.Variance();
  dark.frames = frames.size();
  dark.black_dn = sums.Mean();
  for (std::size_t a = 0; a < 4; ++a) {
    dark.angle_dn[a] = MeanBehind(dark.black_dn, sensor.layout, 45 * int(a));
    dark.mean_dn += dark.angle_dn[a] / 4;
  }
  dark.pixel_spread_dn = DrawToMean(dark.black_dn, sensor.layout, variance / frames.size());
  dark.read_noise_dn = std::sqrt(std::max(0.0, variance - kRoundingVariance));
  return dark;
}

nlohmann::json Summary(const DarkCalibration& dark) {
  return {{"frames", dark.frames},
          {"black_dn", dark.mean_dn},
          {"black_dn_by_angle",
           {{"0", dark.angle_dn[0]},
            {"45", dark.angle_dn[1]},
            {"90", dark.angle_dn[2]},
            {"135", dark.angle_dn[3]}}},
          {"read_noise_dn", dark.read_noise_dn},
          {"pixel_spread_dn", dark.pixel_spread_dn},
          {"samples_at_zero", dark.at_zero}};
}

}  // namespace polarscan
