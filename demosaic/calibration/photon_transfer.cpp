// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/photon_transfer.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace polarscan {
namespace {

constexpr double kFewestSamples = 200;
constexpr double kBrightestLevel = 0.9;  // of the range: above it noise is clipped
constexpr double kPairRounding = 1.0 / 12;

double MeanOverBlack(const Image<float>& counts, const Sensor& sensor, const Image<float>& black_dn) {
  double sum = 0;
  for (std::size_t i = 0; i < counts.size(); ++i)
    sum += counts.pixels()[i] - (black_dn.empty() ? sensor.black_dn : double(black_dn.pixels()[i]));
  return sum / double(counts.size());
}

// Weights follow from the line so far, not from the points, which would favour those that are low by chance.
PhotonTransfer FitLine(const std::vector<TransferPoint>& points, double read_noise_dn,
                       const PhotonTransfer& so_far) {
  const bool read_known = read_noise_dn >= 0;
  const double read2 = read_noise_dn * read_noise_dn;
  double w = 0, wx = 0, wxx = 0, wv = 0, wxv = 0;
  for (const TransferPoint& p : points) {
    const double expected = so_far.dn_per_e > 0
                                ? so_far.dn_per_e * p.level_dn + std::pow(so_far.read_noise_dn, 2)
                                : p.variance_dn2;
    const double weight = double(p.samples) / std::pow(expected + kPairRounding, 2);
    w += weight, wx += weight * p.level_dn, wxx += weight * p.level_dn * p.level_dn;
    wv += weight * p.variance_dn2, wxv += weight * p.level_dn * p.variance_dn2;
  }
  if (read_known) return {std::max(0.0, (wxv - read2 * wx) / wxx), read_noise_dn};
  const double slope = (w * wxv - wx * wv) / (w * wxx - wx * wx), at_zero = (wv - slope * wx) / w;
  if (at_zero < 0) return {wxv / wxx, 0};
  return {std::max(0.0, slope), std::sqrt(at_zero)};
}

}  // namespace

TransferSums::TransferSums(const Sensor& sensor) : sensor_(sensor) {}

void TransferSums::AddRow(int y, const Image<float>& a, const Image<float>& b, const Image<float>& black_dn,
                          double ratio, std::array<std::array<Bin, kBins>, 4>& bins) const {
  for (int x = 0; x < a.width(); ++x) {
    if (sensor_.clips && std::max(a(x, y), b(x, y)) >= float(sensor_.white_dn)) continue;
    const double black = black_dn.empty() ? sensor_.black_dn : double(black_dn(x, y));
    const double first = a(x, y) - black, second = (b(x, y) - black) * ratio, level = (first + second) / 2;
    const auto bin = std::size_t(std::clamp(level / sensor_.RangeDn() * kBins, 0.0, kBins - 1.0));
    Bin& sums = bins[std::size_t(sensor_.layout.AngleAt(x, y) / 45)][bin];
    const double difference = first - second;
    sums.level += level, sums.difference += difference, sums.squares += difference * difference;
    sums.samples += 1;
  }
}

void TransferSums::AddPair(const Image<float>& a, const Image<float>& b, const Image<float>& black_dn) {
  const double ratio = MeanOverBlack(a, sensor_, black_dn) / MeanOverBlack(b, sensor_, black_dn);
  for (int y = 0; y < a.height(); ++y) AddRow(y, a, b, black_dn, ratio, bins_);
}

std::vector<TransferPoint> TransferSums::Points(std::size_t angle) const {
  std::vector<TransferPoint> points;
  for (const Bin& bin : bins_[angle]) {
    if (bin.samples < kFewestSamples || bin.level > kBrightestLevel * sensor_.RangeDn() * bin.samples)
      continue;
    const double mean = bin.difference / bin.samples;
    const double variance = (bin.squares / bin.samples - mean * mean) / 2 - kPairRounding;
    points.push_back({bin.level / bin.samples, std::max(0.0, variance), std::size_t(bin.samples)});
  }
  return points;
}

PhotonTransfer FitTransfer(const std::vector<TransferPoint>& points, double read_noise_dn) {
  const bool read_known = read_noise_dn >= 0;
  double low = 1e300, high = 0;
  for (const TransferPoint& p : points) low = std::min(low, p.level_dn), high = std::max(high, p.level_dn);
  if (points.empty() || (!read_known && high < 2 * low))
    throw Error("the levels are too much alike to see how the noise grows with the light", "the flat frames",
                "Take pairs of frames at several exposures, or calibrate the dark first");
  PhotonTransfer line = FitLine(points, read_noise_dn, {});
  for (int i = 0; i < 3; ++i) line = FitLine(points, read_noise_dn, line);
  return line;
}

}  // namespace polarscan
