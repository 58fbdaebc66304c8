// SPDX-License-Identifier: Apache-2.0
// The controls that a driver has of its own: exposure, gain, mirroring.
#pragma once
#include <fmt/format.h>
#include <linux/videodev2.h>

#include <cctype>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "acquisition/camera/v4l2/device.h"
#include "core/error.h"
#include "core/words.h"

namespace polarscan::v4l2 {

// As v4l2-ctl does it: "Exposure Time, Absolute" is exposure_time_absolute.
inline std::string ControlName(const std::string& name) {
  std::string result;
  for (const unsigned char c : name) {
    if (std::isalnum(c))
      result += char(std::tolower(c));
    else if (!result.empty() && result.back() != '_')
      result += '_';
  }
  while (result.ends_with('_')) result.pop_back();
  return result;
}

// Those that have a value, by name.
inline std::map<std::string, v4l2_queryctrl> Controls(int fd) {
  std::map<std::string, v4l2_queryctrl> controls;
  v4l2_queryctrl control{};
  control.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (Ask(fd, VIDIOC_QUERYCTRL, &control) == 0) {
    const bool valued = control.type != V4L2_CTRL_TYPE_CTRL_CLASS && control.type != V4L2_CTRL_TYPE_BUTTON;
    if (valued && !(control.flags & V4L2_CTRL_FLAG_DISABLED))
      controls[ControlName(TextOf(control.name))] = control;
    control.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return controls;
}

// Throws Error if there is no control of this name or it does not take the value.
inline void SetControl(int fd, const std::string& name, std::int32_t value) {
  const auto controls = Controls(fd);
  const auto found = controls.find(name);
  if (found == controls.end()) {
    std::vector<std::string> names = {"pixel-format", "width", "height", "fps", "input", "buffers"};
    for (const auto& [known, control] : controls) names.push_back(known);
    const std::string nearest = NearestName(name, names);
    throw Error("the camera has no such feature", name,
                (nearest.empty() ? "" : "Did you mean " + nearest + "? ") + "v4l2-ctl -L lists what it has");
  }
  v4l2_control control{found->second.id, value};
  const bool outside = found->second.type == V4L2_CTRL_TYPE_INTEGER &&
                       (value < found->second.minimum || value > found->second.maximum);
  if (outside || Ask(fd, VIDIOC_S_CTRL, &control) < 0)  // the kernel itself would take the nearest
    throw Error("the camera refuses this value", fmt::format("{}={}", name, value),
                fmt::format("From {} to {}", found->second.minimum, found->second.maximum));
}

// Throws Error where an odd offset of the crop or a mirrored picture changes the polarizer layout.
inline void CheckLayout(int fd, const std::string& device) {
  v4l2_selection crop{};
  crop.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  crop.target = V4L2_SEL_TGT_CROP;
  if (Ask(fd, VIDIOC_G_SELECTION, &crop) == 0 && (crop.r.left % 2 != 0 || crop.r.top % 2 != 0))
    throw Error("an odd offset changes the polarizer layout",
                fmt::format("crop at {},{}", crop.r.left, crop.r.top));
  for (const std::uint32_t id : {V4L2_CID_HFLIP, V4L2_CID_VFLIP}) {
    v4l2_control flip{id, 0};
    if (Ask(fd, VIDIOC_G_CTRL, &flip) == 0 && flip.value)
      throw Error("mirrored pictures turn the angles of polarization round", device,
                  "Switch horizontal_flip and vertical_flip off");
  }
}

}  // namespace polarscan::v4l2
