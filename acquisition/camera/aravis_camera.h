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

// Frame numbers as they come (GigE Vision: 16 bits, 0 is left out at the wrap; or 64 bits) made one count
// that starts at 0, also where the first few frames never came. Where a camera does not begin at the
// beginning, the first frame to come is 0. A number from the past gives a count from the past.
class FrameNumbers {
 public:
  explicit FrameNumbers(bool gige) : gige_(gige) {}
  std::uint64_t Unwrap(std::uint64_t number);

 private:
  bool gige_, first_ = true;
  std::uint64_t last_number_ = 0, last_ = 0;
};

}  // namespace polarscan
