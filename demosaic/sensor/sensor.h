// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "core/image.h"
#include "demosaic/sensor/layout.h"

namespace polarscan {

// How the counts (DN) of a picture become light, in units of full scale: ((DN - black) / (white -
// black))^gamma.
struct Sensor {
  Layout layout;            // raw mosaics only
  int bits = 8;             // of a sample as stored; 32: floating point
  double black_dn = 0;      // DN without light
  double white_dn = 255;    // DN of full scale
  bool clips = true;        // samples at white_dn or above carry no information
  double dn_per_e = 0;      // DN per electron; 0: unknown, the noise is then estimated from the picture
  double read_noise_e = 0;  // standard deviation, electrons
  double gamma = 1;         // 1: the counts are linear in light

  double RangeDn() const { return white_dn - black_dn; }
  // Standard deviation of rounding to whole counts, in units of full scale.
  double QuantizationNoise() const;
};

nlohmann::json ToJson(const Sensor& sensor);

// Counts to light. Counts below black give negative light: cutting them off would bias S0 and the noise.
Image<float> ToLight(const Image<float>& counts, const Sensor& sensor);
// The same with a black level of each pixel's own; empty: as above. Needs gamma 1.
Image<float> ToLight(const Image<float>& counts, const Sensor& sensor, const Image<float>& black_dn);

// The count from which on samples are saturated, as they show it themselves: where they pile up at the top of
// their histogram, the lower end of the pile; else white_dn. Sensors that subtract their black level, or
// whose full well ends before their counts do, saturate below the end of their bits. A pile is narrow (a
// thousandth of the range, above an eighth of it) or, within the last tenth of the range, as wide as noise
// makes it. histogram[n]: how many samples have the count n.
double SaturationLevel(std::span<const std::uint64_t> histogram, const Sensor& sensor);

// Adds the counts, rounded down, to a histogram of 65536 values.
void AddToHistogram(const Image<float>& counts, std::vector<std::uint64_t>& histogram);

// 1 where a sample is clipped.
Image<std::uint8_t> Clipped(const Image<float>& counts, const Sensor& sensor);

// 1 where a mark that is not 0 lies within `reach` pixels (a square).
Image<std::uint8_t> Grown(Image<std::uint8_t> marks, int reach);

}  // namespace polarscan
