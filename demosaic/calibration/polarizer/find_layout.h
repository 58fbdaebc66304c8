// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <vector>

#include "core/progress.h"
#include "demosaic/calibration/frames.h"
#include "demosaic/sensor/layout.h"
#include "demosaic/sensor/sensor.h"

namespace polarscan {

// Mean light of each of the four places of the 2x2 cell (row by row), in one frame.
using CellMeans = std::array<double, 4>;

struct FoundLayout {
  Layout layout;                   // without the Bayer order, which polarizers do not show
  std::vector<double> angles_deg;  // the polarizer's, of each frame, by this layout
  double first_error_deg = 0;      // of the first frame from the angle it was said to have
  double turn_deg = 0;             // from the first to the last frame
};

// The layout of a sensor that saw one linear polarizer turned in one sense, frames in order, each less than
// 80 degrees from the one before. first_deg: the angle of the first frame as displayed, anticlockwise from +x
// (0: it passes horizontally swinging light), to better than 20 degrees. anticlockwise: the sense as
// displayed (seen from the camera, towards the polarizer). Which places are 90 degrees apart shows in their
// sum being even; which of a pair comes first in their order; which pair is 0 and 90 in the first frame.
// Throws Error where that is not clear.
FoundLayout FindLayout(const std::vector<CellMeans>& frames, double first_deg, bool anticlockwise);

// The frames' means. sensor: black and white level. Throws Error for clipped frames.
std::vector<CellMeans> MeanCells(const CalibrationFrames& frames, const Sensor& sensor, Progress& progress);

}  // namespace polarscan
