// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <nlohmann/json.hpp>

#include "core/progress.h"
#include "demosaic/calibration/frames.h"
#include "demosaic/sensor/sensor.h"

namespace polarscan {

// What frames without light tell.
struct DarkCalibration {
  Image<float> black_dn;             // of each pixel
  double mean_dn = 0;                // of all
  std::array<double, 4> angle_dn{};  // behind 0, 45, 90, 135 degrees
  double read_noise_dn = 0;          // standard deviation in time of a pixel, without rounding
  double pixel_spread_dn = 0;        // true standard deviation of the pixels' black levels
  std::size_t at_zero = 0;           // samples that were cut off at 0
  int frames = 0;
};

// Means over the frames, drawn towards the mean of all pixels behind the same angle by as much as the frames'
// noise makes up of their spread (James-Stein): few frames never make a picture noisier than none. Throws
// Error for fewer than 4 frames and for a frame that is not dark.
DarkCalibration CalibrateDark(const CalibrationFrames& frames, const Sensor& sensor, Progress& progress);

nlohmann::json Summary(const DarkCalibration& dark);

// Draws values towards the mean of those behind the same polarizer angle: by noise / (spread), both
// variances. Returns the true spread (standard deviation) of the values.
double DrawToMean(Image<float>& values, const Layout& layout, double noise_variance);

}  // namespace polarscan
