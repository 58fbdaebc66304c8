// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/camera/camera.h"

namespace polarscan {

// GigE Vision and USB3 Vision cameras that can be seen now, by Aravis 0.8.
std::vector<CameraInfo> ListAravisCameras();

// name: Aravis' id of the camera, its serial number, or its network address. Features: the camera's own
// (GenICam), and buffers = how many frames Aravis may hold.
//
// Start switches automatic functions off and checks that pictures are linear in light, and refuses odd
// offsets and mirrored pictures (they change the layout); what it did comes as Progress::Info and Warn. When
// control of the camera is lost, Next looks for it by its hardware address (USB: serial number) again and
// again, gives it its settings back, checks them, and goes on (Delivery::kRestarted). A frame is whole if all
// its packets came from the camera, cut as agreed, and its format and size are as the camera is set.
std::unique_ptr<Camera> OpenAravisCamera(const std::string& name);

}  // namespace polarscan
