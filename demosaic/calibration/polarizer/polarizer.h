// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>

#include "core/progress.h"
#include "demosaic/calibration/frames.h"
#include "demosaic/calibration/polarizer/polarizer_light.h"
#include "demosaic/calibration/response_fit.h"
#include "demosaic/sensor/sensor.h"

namespace polarscan {

// What the frames of a linear polarizer, turned in front of even light, tell about the sensor.
struct PolarizerCalibration {
  ResponseMap responses;
  Image<float> condition;  // of each cell, half the size
  Image<float> residual;   // of each pixel's fit, in light; infinite where clipped
  PolarizerLight light;
  std::size_t defects = 0, clipped = 0;  // pixels
};

// sensor: layout, black and white level. black_dn: of each pixel, or empty. known.frames is set here. Reads
// every frame twice. Warns of frames that do not fit the others (PolarizerLight::doubts). Throws Error as
// FindPolarizerLight does, and for a frame that is clipped or dark.
PolarizerCalibration CalibratePolarizer(const CalibrationFrames& frames, const Sensor& sensor,
                                        const Image<float>& black_dn, PolarizerKnowledge known,
                                        bool keep_shading, Progress& progress);

// Numbers of it: frames, angles, medians and spreads of gain, diattenuation and angle, how well a pixel's
// are known, frames that were doubted, condition, residual.
nlohmann::json Summary(const PolarizerCalibration& calibration, const Layout& layout);

}  // namespace polarscan
