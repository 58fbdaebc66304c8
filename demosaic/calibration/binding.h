// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "demosaic/sensor/layout.h"

namespace polarscan {

// Which camera, set how, pictures were taken with: a calibration holds for these and no others. What a source
// does not say is not there.
struct CameraBinding {
  nlohmann::json camera = nlohmann::json::object();    // "vendor", "model", "serial"
  nlohmann::json settings = nlohmann::json::object();  // "width", "height", "layout", "bits"; "OffsetX", ...
};

// camera: as in session.json; "id" (an address) does not count. features: all of the camera's; of them those
// count that change which pixel is where or what its counts mean: offsets, mirroring, binning, gain, black
// level, gamma. Exposure does not, and neither does the packing of the pixel format.
CameraBinding MakeBinding(const nlohmann::json& camera, const nlohmann::json& features, int width, int height,
                          const Layout& layout, int bits);

// 16 hexadecimal digits.
std::string HashOf(const CameraBinding& binding);

// Throws Error that says what differs ("serial 17 instead of 12"); what one of the two does not say does not
// differ. where: the pictures and the calibration.
void RequireSame(const CameraBinding& calibration, const CameraBinding& pictures, const std::string& where);

}  // namespace polarscan
