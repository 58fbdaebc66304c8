// SPDX-License-Identifier: Apache-2.0
#include "demosaic/sensor.h"

#include <algorithm>
#include <cmath>

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
