// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/polarizer/polarizer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/error.h"

namespace polarscan {
namespace {

using nlohmann::json;

constexpr int kSampledCells = 5000;
constexpr double kMostClipped = 0.05;  // share of the samples of a frame
constexpr double kDarkest = 0.01;      // mean light of a frame

void RequireLight(const Image<float>& light, const std::string& name) {
  double sum = 0;
  for (const float value : light.pixels()) sum += value;
  if (sum < kDarkest * double(light.size()))
    throw Error(fmt::format("this frame is dark, {:.2f} % of full scale", 100 * sum / double(light.size())),
                name, "Expose more, or is the black level wrong?");
}

// Top-left pixels of cells all over the sensor.
std::vector<std::pair<int, int>> SampledCells(int width, int height) {
  const double cells = double(width / 2) * (height / 2);
  const int step = 2 * std::max(1, int(std::ceil(std::sqrt(cells / kSampledCells))));
  std::vector<std::pair<int, int>> places;
  for (int y = 0; y + 1 < height; y += step)
    for (int x = 0; x + 1 < width; x += step) places.emplace_back(x, y);
  return places;
}

class Sampler {
 public:
  Sampler(int width, int height, const Layout& layout, int frames) : places_(SampledCells(width, height)) {
    readings_.light.resize(Eigen::Index(4 * places_.size()), frames);
    usable_.assign(places_.size(), true);
    for (const auto& [x, y] : places_)
      for (int i = 0; i < 4; ++i) readings_.angles_deg.push_back(layout.AngleAt(x + (i & 1), y + (i >> 1)));
  }

  void Add(int frame, const Image<float>& light, const Image<std::uint8_t>& clipped) {
    for (std::size_t c = 0; c < places_.size(); ++c)
      for (int i = 0; i < 4; ++i) {
        const int x = places_[c].first + (i & 1), y = places_[c].second + (i >> 1);
        readings_.light(Eigen::Index(4 * c) + i, frame) = light(x, y);
        if (clipped(x, y)) usable_[c] = false;
      }
  }

  // Without the cells that were clipped once.
  PolarizerReadings Usable() const {
    PolarizerReadings usable;
    std::vector<Eigen::Index> rows;
    for (std::size_t row = 0; row < readings_.angles_deg.size(); ++row) {
      if (!usable_[row / 4]) continue;
      rows.push_back(Eigen::Index(row));
      usable.angles_deg.push_back(readings_.angles_deg[row]);
    }
    usable.light = readings_.light(rows, Eigen::all);
    return usable;
  }

 private:
  std::vector<std::pair<int, int>> places_;
  std::vector<bool> usable_;
  PolarizerReadings readings_;
};

// Median, and half of the range that holds 68 % of the values: the standard deviation of normal ones.
json Spread(std::vector<float> values) {
  std::erase_if(values, [](float value) { return !std::isfinite(value); });
  if (values.empty()) return {{"median", nullptr}, {"spread", nullptr}};
  std::ranges::sort(values);
  const auto at = [&](double share) { return values[std::size_t(share * double(values.size() - 1))]; };
  return {{"median", at(0.5)}, {"spread", (at(0.84) - at(0.16)) / 2}, {"worst", values.back()}};
}

// Of the pixels behind one polarizer angle, or of all (-1).
json SummaryOfAngle(const ResponseMap& map, const Layout& layout, int angle_deg) {
  std::vector<float> gains, diattenuations, errors;
  for (int y = 0; y < map.height(); ++y)
    for (int x = 0; x < map.width(); ++x) {
      const Response r = map.At(x, y);
      const int own = layout.AngleAt(x, y);
      if (r.Defect() || (angle_deg >= 0 && own != angle_deg)) continue;
      gains.push_back(r.Gain()), diattenuations.push_back(r.Diattenuation());
      errors.push_back(AngleErrorDeg(r, own));
    }
  return {{"gain", Spread(std::move(gains))},
          {"diattenuation", Spread(std::move(diattenuations))},
          {"angle_error_deg", Spread(std::move(errors))}};
}

void WarnOfDoubts(const PolarizerLight& light, Progress& progress) {
  for (const FrameDoubt& doubt : light.doubts)
    progress.Warn(fmt::format("{}: {}; {}", doubt.name, doubt.words,
                              doubt.left_out ? "this frame is left out"
                                             : "this frame counts only by the light that its pixels show"));
}

// Of one pixel's response behind one angle, one standard deviation; "shared": what all pixels have in
// common of it.
json Uncertainty(const ResponseDeviation& by_noise, const ResponseDeviation& by_light) {
  return {{"angle_deg", std::hypot(by_noise.angle_deg, by_light.angle_deg)},
          {"diattenuation", std::hypot(by_noise.diattenuation, by_light.diattenuation)},
          {"shared_angle_deg", by_light.angle_deg},
          {"shared_diattenuation", by_light.diattenuation}};
}

// Root mean square of the four angles'.
ResponseDeviation MeanOf(const std::array<ResponseDeviation, 4>& deviations) {
  ResponseDeviation mean;
  for (const ResponseDeviation& one : deviations) {
    mean.angle_deg = std::hypot(mean.angle_deg, one.angle_deg / 2);
    mean.diattenuation = std::hypot(mean.diattenuation, one.diattenuation / 2);
  }
  return mean;
}

json SummaryOfDoubts(const PolarizerLight& light) {
  json doubts = json::array();
  for (const FrameDoubt& doubt : light.doubts)
    doubts.push_back({{"frame", doubt.name}, {"why", doubt.words}, {"left_out", doubt.left_out}});
  return doubts;
}

}  // namespace

PolarizerCalibration CalibratePolarizer(const CalibrationFrames& frames, const Sensor& sensor,
                                        const Image<float>& black_dn, PolarizerKnowledge known,
                                        bool keep_shading, Progress& progress) {
  known.frames = frames.names;
  std::optional<Sampler> sampler;
  progress.Begin("the polarizer's light", frames.names.size(), "frame");
  for (int k = 0; k < frames.size(); ++k) {
    progress.Check();
    const Image<float> counts = frames.counts(k), light = ToLight(counts, sensor, black_dn);
    const Image<std::uint8_t> clipped = Clipped(counts, sensor);
    RequireExposed(clipped, kMostClipped, frames.names[std::size_t(k)]);
    RequireLight(light, frames.names[std::size_t(k)]);
    if (!sampler) sampler.emplace(counts.width(), counts.height(), sensor.layout, frames.size());
    sampler->Add(k, light, clipped);
    progress.Advance();
  }
  if (!sampler) throw Error("there are no frames", "the turned polarizer");
  PolarizerCalibration result;
  result.light = FindPolarizerLight(sampler->Usable(), known);
  WarnOfDoubts(result.light, progress);

  std::optional<ResponseFit> fit;
  progress.Begin("the pixels' responses", frames.names.size(), "frame");
  for (int k = 0; k < frames.size(); ++k) {
    progress.Check();
    progress.Advance();
    if (result.light.weights.col(k).isZero()) continue;
    const Image<float> counts = frames.counts(k);
    if (!fit) fit.emplace(counts.width(), counts.height(), sensor.layout);
    fit->Add(ToLight(counts, sensor, black_dn), Clipped(counts, sensor), result.light.stokes.col(k),
             result.light.weights.col(k));
  }
  FittedResponses fitted = fit->Solve();
  NormalizeGains(fitted.responses, sensor.layout,
                 keep_shading ? GainReference::kPicture : GainReference::kNeighbourhood);
  result.defects = MarkDefects(fitted.responses, sensor.layout);
  result.clipped = fitted.clipped;
  result.responses = std::move(fitted.responses);
  result.residual = std::move(fitted.residual);
  result.condition = ConditionNumbers(result.responses);
  return result;
}

json Summary(const PolarizerCalibration& calibration, const Layout& layout) {
  const ResponseMap& map = calibration.responses;
  json summary = SummaryOfAngle(map, layout, -1);
  const PolarizerLight& light = calibration.light;
  for (std::size_t i = 0; i < 4; ++i) {
    json& own = summary["polarizers"][std::to_string(45 * i)];
    own = SummaryOfAngle(map, layout, int(45 * i));
    own["uncertainty"] = Uncertainty(light.by_noise[i], light.by_light[i]);
  }
  summary["uncertainty"] = Uncertainty(MeanOf(light.by_noise), MeanOf(light.by_light));
  summary["doubtful_frames"] = SummaryOfDoubts(light);
  summary["frames"] = light.angles_deg.size();
  summary["angles_deg"] = light.angles_deg;
  summary["zero_deg"] = light.zero_deg;
  summary["largest_angle_error_deg"] = light.largest_error_deg;
  summary["frames_condition"] = light.condition;
  const Eigen::RowVectorXd s0 = light.stokes.row(0);
  summary["brightness_range"] = {s0.minCoeff(), s0.maxCoeff()};
  summary["defect_pixels"] = calibration.defects;
  summary["clipped_pixels"] = calibration.clipped;
  const auto condition = calibration.condition.pixels(), residual = calibration.residual.pixels();
  summary["condition"] = Spread({condition.begin(), condition.end()});
  summary["residual"] = Spread({residual.begin(), residual.end()});
  return summary;
}

}  // namespace polarscan
