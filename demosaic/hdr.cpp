// SPDX-License-Identifier: Apache-2.0
#include "demosaic/hdr.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "demosaic/sensor/noise.h"

namespace polarscan {
namespace {

// One exposure in light of the shortest one.
struct Layer {
  LitMosaic mosaic;
  Image<std::uint8_t> clipped;
  float factor = 1;  // shortest time / its time
};

struct Place {
  int x0, y0, x1, y1;  // of a cell, both ends inside
};

void CheckExposures(const std::vector<Exposure>& exposures) {
  if (exposures.empty()) throw Error("there is no exposure to merge", "HDR");
  for (const Exposure& exposure : exposures) {
    if (!(exposure.time > 0)) throw Error("an exposure time must be above 0", std::to_string(exposure.time));
    if (!SameSize(exposure.counts, exposures[0].counts))
      throw Error("the exposures of one view differ in size", "HDR");
  }
}

// Longest first.
std::vector<Layer> MakeLayers(const std::vector<Exposure>& exposures, const Sensor& sensor,
                              const MosaicCorrection& correction) {
  double shortest = exposures[0].time;
  for (const Exposure& exposure : exposures) shortest = std::min(shortest, exposure.time);
  std::vector<Layer> layers;
  for (const Exposure& exposure : exposures)
    layers.push_back({ToLitMosaic(exposure.counts, sensor, correction), Clipped(exposure.counts, sensor),
                      float(shortest / exposure.time)});
  std::ranges::stable_sort(layers, {}, &Layer::factor);
  return layers;
}

template <class F>
void ForEachPixel(const Place& place, F&& f) {
  for (int y = place.y0; y <= place.y1; ++y)
    for (int x = place.x0; x <= place.x1; ++x) f(x, y);
}

bool IsClipped(const Layer& layer, const Place& place) {
  bool clipped = false;
  ForEachPixel(place, [&](int x, int y) { clipped |= layer.clipped(x, y) != 0; });
  return clipped;
}

float MeanLight(const Layer& layer, const Place& place) {
  float sum = 0, count = 0;
  ForEachPixel(place, [&](int x, int y) { sum += layer.mosaic.light(x, y) * layer.factor, ++count; });
  return sum / count;
}

class Merger {
 public:
  Merger(const std::vector<Layer>& layers, const Sensor& sensor)
      : layers_(layers), known_(sensor.dn_per_e > 0), noise_(known_ ? SensorNoise(sensor) : NoiseModel()) {}

  // merged: holds the shortest exposure.
  void Merge(const Place& place, LitMosaic& merged) const {
    const Layer* longest = nullptr;
    for (const Layer& layer : layers_)
      if (!IsClipped(layer, place)) {
        longest = &layer;
        break;
      }
    const float level = MeanLight(longest ? *longest : layers_.back(), place);
    if (!longest) return SetNoise(place, 1 / Variance(layers_.back(), level), merged);
    float weights = 0;
    ForEachPixel(place,
                 [&](int x, int y) { merged.light(x, y) = 0, merged.state(x, y) = SampleState::kMeasured; });
    for (const Layer& layer : layers_) {
      if (IsClipped(layer, place)) continue;
      const float weight = 1 / Variance(layer, level);
      weights += weight;
      ForEachPixel(place, [&](int x, int y) {
        merged.light(x, y) += weight * layer.factor * layer.mosaic.light(x, y);
        merged.state(x, y) = std::max(merged.state(x, y), layer.mosaic.state(x, y));
      });
    }
    ForEachPixel(place, [&](int x, int y) { merged.light(x, y) /= weights; });
    SetNoise(place, weights, merged);
  }

 private:
  // Of a sample of this level (of the shortest exposure's light), in that light; arbitrary unit if unknown.
  float Variance(const Layer& layer, float level) const {
    if (!known_) return layer.factor;
    const float sigma = noise_.Sigma(level / layer.factor) * layer.factor;
    return sigma * sigma;
  }
  void SetNoise(const Place& place, float weights, LitMosaic& merged) const {
    if (known_) ForEachPixel(place, [&](int x, int y) { merged.noise(x, y) = 1 / std::sqrt(weights); });
  }

  const std::vector<Layer>& layers_;
  bool known_;
  NoiseModel noise_;
};

}  // namespace

LitMosaic MergeExposures(const std::vector<Exposure>& exposures, const Sensor& sensor,
                         const MosaicCorrection& correction) {
  CheckExposures(exposures);
  const std::vector<Layer> layers = MakeLayers(exposures, sensor, correction);
  LitMosaic merged = layers.back().mosaic;
  const int width = merged.light.width(), height = merged.light.height();
  if (sensor.dn_per_e > 0) merged.noise = Image<float>(width, height);
  const Merger merger(layers, sensor);
  ParallelFor(0, (height + 1) / 2, [&](int j) {
    for (int x = 0; x < width; x += 2)
      merger.Merge({x, 2 * j, std::min(x + 1, width - 1), std::min(2 * j + 1, height - 1)}, merged);
  });
  return merged;
}

}  // namespace polarscan
