// SPDX-License-Identifier: Apache-2.0
#include "acquisition/camera/camera.h"

#include "acquisition/camera/aravis_camera.h"
#include "acquisition/camera/replay_camera.h"
#include "acquisition/camera/v4l2_camera.h"

namespace polarscan {

nlohmann::json ToJson(const CameraInfo& info) {
  return {{"id", info.id}, {"vendor", info.vendor}, {"model", info.model}, {"serial", info.serial}};
}

std::vector<CameraInfo> ListCameras() {
  std::vector<CameraInfo> cameras = ListAravisCameras();
  for (CameraInfo& camera : ListV4l2Cameras()) cameras.push_back(std::move(camera));
  return cameras;
}

std::unique_ptr<Camera> OpenCamera(const std::string& id) {
  constexpr std::string_view kReplay = "replay:";
  if (id.starts_with(kReplay)) return OpenReplayCamera(id.substr(kReplay.size()));
  if (id.starts_with("/dev/")) return OpenV4l2Camera(id);
  return OpenAravisCamera(id);
}

}  // namespace polarscan
