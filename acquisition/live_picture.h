// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <map>
#include <string>

#include "acquisition/camera/frame.h"
#include "demosaic/sensor/sensor.h"
#include "demosaic/stokes.h"

namespace polarscan {

// What a person at the camera wants to know about the frame that just came.
struct LivePicture {
  // Of cells, one of every few, at most `largest_side` px, in units of full scale as elsewhere; noise is 0,
  // or infinite where a sample of the cell is clipped.
  StokesImage stokes;
  // Share of saturated samples (SaturationLevel) behind the polarizer at 0, 45, 90, 135 degrees.
  std::array<double, 4> clipped{};
  double level = 0;  // mean sample, of full scale
  double sharpness =
      0;  // mean squared Laplacian of S0 over its mean square, in 1000ths: compare, do not read
};

// sensor: layout, black_dn and white_dn count; white_dn is the end of the bits where no more is known. Throws
// Error if the frame's format is no raw mosaic.
LivePicture LookAt(const Frame& frame, const Sensor& sensor, int largest_side);

// What to do about it, in words, by cause ("clipped", "dark").
std::map<std::string, std::string> Advice(const LivePicture& view);

}  // namespace polarscan
