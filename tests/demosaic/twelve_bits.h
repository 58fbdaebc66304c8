// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <string>

#include "core/image.h"
#include "demosaic/polar_view.h"

namespace polarscan::test {

inline const DemosaicMethod& Bilinear() { return FindDemosaicMethod("bilinear"); }

// What a sensor counts of light in units of its full scale.
inline Image<float> ToCounts(Image<float> light, const Sensor& sensor) {
  for (float& value : light.pixels())
    value = std::min(float(sensor.white_dn), std::round(float(sensor.black_dn + value * sensor.RangeDn())));
  return light;
}

// A sensor of 12 bits with black level 60.
inline Sensor TwelveBits(const std::string& layout) {
  Sensor sensor;
  sensor.layout = ParseLayout(layout);
  sensor.bits = 12, sensor.black_dn = 60, sensor.white_dn = 4095;
  return sensor;
}

}  // namespace polarscan::test
