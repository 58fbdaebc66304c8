// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/camera/camera.h"

namespace polarscan {

// ListCameras and OpenCamera (acquisition/camera/camera.h) with the simulated camera among the others, as
// "simulated".
std::vector<CameraInfo> ListAllCameras();
std::unique_ptr<Camera> OpenAnyCamera(const std::string& id, std::uint64_t seed = 0);

}  // namespace polarscan
