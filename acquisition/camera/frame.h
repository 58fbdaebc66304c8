// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace polarscan {

// What is known about one frame. NaN: the camera does not say.
struct FrameInfo {
  std::uint64_t sequence = 0;  // the camera's frame number, unwrapped: a gap means frames that never came
  std::int64_t camera_time_ns = 0;  // by the camera's clock; 0: unknown
  std::int64_t host_time_ns = 0;    // Unix time at which the frame was complete here
  std::string pixel_format;         // its PFNC name (demosaic/sensor/pixel_format.h)
  int width = 0, height = 0;        // px
  int stride = 0;                   // bytes from row to row; 0: no padding
  double exposure_us = std::numeric_limits<double>::quiet_NaN();
  double gain_db = std::numeric_limits<double>::quiet_NaN();
  double temperature_c = std::numeric_limits<double>::quiet_NaN();
  std::uint64_t shot = 0;  // frames of one shot show the same thing and become one view
  std::string name;        // the view's name, where it has one; at most 63 bytes
};

// By how much more the camera's clock went on than the host's between two frames, s; 0 if a time is not
// known.
inline double ClockJump(const FrameInfo& before, const FrameInfo& now) {
  if (before.camera_time_ns == 0 || now.camera_time_ns == 0) return 0;
  return 1e-9 * (double(now.camera_time_ns - before.camera_time_ns) -
                 double(now.host_time_ns - before.host_time_ns));
}
// What is no mere delay of frames on their way.
inline constexpr double kClockJump_s = 5;

// A frame as the camera sent it, packed.
struct Frame {
  FrameInfo info;
  std::vector<std::uint8_t> payload;
};

}  // namespace polarscan
