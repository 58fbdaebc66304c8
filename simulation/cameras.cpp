// SPDX-License-Identifier: Apache-2.0
#include "simulation/cameras.h"

#include "simulation/simulated_camera.h"

namespace polarscan {

std::vector<CameraInfo> ListAllCameras() {
  std::vector<CameraInfo> cameras = ListCameras();
  cameras.push_back(OpenSimulatedCamera(SimulatedCameraOptions())->info());
  return cameras;
}

std::unique_ptr<Camera> OpenAnyCamera(const std::string& id, std::uint64_t seed) {
  if (id != "simulated") return OpenCamera(id);
  SimulatedCameraOptions options;
  options.simulator.seed = seed;
  return OpenSimulatedCamera(options);
}

}  // namespace polarscan
