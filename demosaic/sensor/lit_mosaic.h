// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>

#include "demosaic/calibration/response.h"
#include "demosaic/sensor/sensor.h"

namespace polarscan {

// What is known about the single pixels of a sensor; empty: not known, then the Sensor's values and ideal
// polarizers count.
struct MosaicCorrection {
  Image<float> black_dn;  // count without light
  ResponseMap responses;

  bool empty() const { return black_dn.empty() && responses.empty(); }
};

// Where a sample's value comes from.
enum class SampleState : std::uint8_t {
  kMeasured,
  kRecovered,  // clipped or a defect pixel's, alone in its cell: it follows from the other three
  kLost,       // not the only one in its cell: the value means nothing
};

// The noise of S0, S1, S2 with a recovered sample, at worst, over that without: S1 = I0 - I90 with
// I90 = I45 + I135 - I0 is 2 I0 - I45 - I135, variance 6 instead of 2.
inline constexpr float kRecoveredNoise = 1.7320508f;

// A raw mosaic as light in units of full scale, as ideal polarizers would show it: what every demosaicing
// method starts from.
struct LitMosaic {
  Image<float> light;
  Image<SampleState> state;
  Image<float> noise = {};  // standard deviation of each sample; empty: it follows from the light
};

// From counts as stored: black subtracted, what is clipped recovered cell by cell where it can be, the
// pixels' own responses undone (demosaic/calibration/cell.h). A recovered sample that was clipped is at least
// full scale. The correction needs gamma 1 and the picture's size, else Error.
LitMosaic ToLitMosaic(const Image<float>& counts, const Sensor& sensor,
                      const MosaicCorrection& correction = {});

// The same rule for four ideal samples of one place in the order 0, 45, 90, 135 degrees: the place's state
// after recovering.
SampleState RecoverClipped(std::array<float, 4>& light, const std::array<bool, 4>& clipped);

}  // namespace polarscan
