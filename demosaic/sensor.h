// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>

#include "core/image.h"
#include "demosaic/layout.h"

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

// 1 where a sample is clipped.
Image<std::uint8_t> Clipped(const Image<float>& counts, const Sensor& sensor);

// 1 where a mark that is not 0 lies within `reach` pixels (a square).
Image<std::uint8_t> Grown(Image<std::uint8_t> marks, int reach);

}  // namespace polarscan
