// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/flat.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "demosaic/calibration/dark.h"
#include "demosaic/calibration/photon_transfer.h"
#include "demosaic/calibration/response_fit.h"

namespace polarscan {
namespace {

constexpr double kSameLight = 0.03;        // by which the means of a pair may differ
constexpr double kMostClippedFlat = 0.05;  // share of a frame's samples
constexpr double kDarkestFlat = 0.005;     // mean light of a frame that counts for the gains

double MeanOf(const Image<float>& image) {
  double sum = 0;
  for (const float value : image.pixels()) sum += value;
  return sum / double(image.size());
}

// The light of all frames, each over its mean, and how much noise is left in it.
struct GainSums {
  Image<float> sum;
  double noise_variance = 0;  // of the sum
  int frames = 0;

  void Add(const Image<float>& light, double mean) {
    if (frames++ == 0) sum = Image<float>(light.width(), light.height());
    for (std::size_t i = 0; i < light.size(); ++i) sum.pixels()[i] += light.pixels()[i] / float(mean);
  }
};

// Gains of the pixels from the mean of all frames.
void SetGains(GainSums& sums, const Sensor& sensor, const FlatOptions& options, FlatCalibration& flat) {
  for (float& value : sums.sum.pixels()) value /= float(sums.frames);
  std::array<double, 4> means{}, counts{};
  for (int y = 0; y < sums.sum.height(); ++y)
    for (int x = 0; x < sums.sum.width(); ++x) {
      const auto a = std::size_t(sensor.layout.AngleAt(x, y) / 45);
      means[a] += sums.sum(x, y), counts[a] += 1;
    }
  double mean = 0;
  for (std::size_t a = 0; a < 4; ++a) mean += means[a] / counts[a] / 4;
  for (std::size_t a = 0; a < 4; ++a) flat.gain_by_angle[a] = means[a] / counts[a] / mean;

  flat.responses = IdealResponses(sums.sum.width(), sums.sum.height(), sensor.layout);
  const auto set_gain = [&](int x, int y, float gain) {
    const Response ideal = IdealResponse(sensor.layout.AngleAt(x, y));
    flat.responses.Set(x, y, {ideal.a0 * gain, ideal.a1 * gain, ideal.a2 * gain});
  };
  for (int y = 0; y < sums.sum.height(); ++y)
    for (int x = 0; x < sums.sum.width(); ++x) set_gain(x, y, sums.sum(x, y));
  NormalizeGains(flat.responses, sensor.layout,
                 options.unpolarized ? GainReference::kNeighbourhood : GainReference::kNeighbourhoodOfAngle);
  Image<float> gains = flat.responses.a0;
  for (float& gain : gains.pixels()) gain *= 2;
  flat.gain_spread = DrawToMean(gains, sensor.layout, sums.noise_variance);
  for (int y = 0; y < gains.height(); ++y)
    for (int x = 0; x < gains.width(); ++x) set_gain(x, y, gains(x, y));
  MarkDefects(flat.responses, sensor.layout);
}

}  // namespace

FlatCalibration CalibrateFlat(const CalibrationFrames& frames, const Sensor& sensor,
                              const Image<float>& black_dn, double read_noise_dn, const FlatOptions& options,
                              Progress& progress) {
  if (frames.size() < 2)
    throw Error(fmt::format("too few frames: {} where at least 2 are needed", frames.size()),
                "the flat frames", "Take two or more at each of several exposures");
  FlatCalibration flat;
  TransferSums transfer(sensor);
  GainSums gains;
  std::vector<double> means;
  Image<float> before;
  progress.Begin("flat frames", frames.names.size(), "frame");
  for (int k = 0; k < frames.size(); ++k) {
    progress.Check();
    Image<float> counts = frames.counts(k);
    RequireExposed(Clipped(counts, sensor), kMostClippedFlat, frames.names[std::size_t(k)]);
    const Image<float> light = ToLight(counts, sensor, black_dn);
    means.push_back(MeanOf(light));
    if (k > 0 && means[std::size_t(k)] > 0 &&
        std::abs(means[std::size_t(k - 1)] / means[std::size_t(k)] - 1) < kSameLight) {
      transfer.AddPair(before, counts, black_dn);
      ++flat.pairs;
    }
    if (means.back() > kDarkestFlat) gains.Add(light, means.back());
    before = std::move(counts);
    progress.Advance();
  }
  flat.frames = frames.size();
  if (flat.pairs == 0)
    throw Error("no two frames that follow each other are of the same light (to 3 %)", "the flat frames",
                "Take two or more at each exposure, with names in that order");
  for (std::size_t a = 0; a < 4; ++a) {
    const std::vector<TransferPoint> points = transfer.Points(a);
    flat.by_angle[a] = FitTransfer(points, read_noise_dn);
    flat.points.insert(flat.points.end(), points.begin(), points.end());
  }
  flat.all = FitTransfer(flat.points, read_noise_dn);
  if (gains.frames == 0) throw Error("all frames are dark", "the flat frames", "Expose more");
  for (const double mean : means)
    if (mean > kDarkestFlat) {
      const double level_dn = mean * sensor.RangeDn();
      const double variance = flat.all.dn_per_e * level_dn + std::pow(flat.all.read_noise_dn, 2);
      gains.noise_variance += variance / (level_dn * level_dn) / (double(gains.frames) * gains.frames);
    }
  SetGains(gains, sensor, options, flat);
  return flat;
}

nlohmann::json Summary(const FlatCalibration& flat, const Sensor& sensor) {
  nlohmann::json summary = {{"frames", flat.frames},
                            {"pairs", flat.pairs},
                            {"dn_per_e", flat.all.dn_per_e},
                            {"read_noise_dn", flat.all.read_noise_dn},
                            {"gain_spread", flat.gain_spread}};
  if (flat.all.dn_per_e > 0) {
    summary["read_noise_e"] = flat.all.read_noise_dn / flat.all.dn_per_e;
    summary["full_scale_e"] = sensor.RangeDn() / flat.all.dn_per_e;
  }
  for (std::size_t a = 0; a < 4; ++a)
    summary["polarizers"][std::to_string(45 * a)] = {{"dn_per_e", flat.by_angle[a].dn_per_e},
                                                     {"read_noise_dn", flat.by_angle[a].read_noise_dn},
                                                     {"gain", flat.gain_by_angle[a]}};
  for (const TransferPoint& p : flat.points)
    summary["points"].push_back(
        {{"level_dn", p.level_dn}, {"variance_dn2", p.variance_dn2}, {"samples", p.samples}});
  return summary;
}

}  // namespace polarscan
