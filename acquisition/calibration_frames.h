// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/input/input.h"
#include "demosaic/calibration/frames.h"

namespace polarscan {

// The frames of an INPUT of raw mosaics (pictures or a session) for a calibration, sorted by name. single:
// every frame of a shot by itself, as their noise needs it; else a shot of several frames is their median.
// Keeps the input. Throws Error if it is of another kind.
CalibrationFrames FramesOf(std::shared_ptr<const Input> input, bool single);

}  // namespace polarscan
