// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>

#include "demosaic/calibration/polarizer/polarizer.h"

namespace polarscan {

// Pictures for people, dark for low and bright for high values, grey where there is none: gain.png,
// diattenuation.png, angle_error.png, residual.png, condition.png (of cells); and the last two as float32
// TIFF. Returns {"gain.png": {"from": 0.95, "to": 1.05}, ...}: what the darkest and the brightest colour
// stand for, 1st and 99th percentile.
nlohmann::json WriteCalibrationPictures(const std::filesystem::path& folder,
                                        const PolarizerCalibration& calibration, const Layout& layout);

}  // namespace polarscan
