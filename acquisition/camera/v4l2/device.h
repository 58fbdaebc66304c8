// SPDX-License-Identifier: Apache-2.0
// Talking with a V4L2 device.
#pragma once
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <string>

#include "core/error.h"

namespace polarscan::v4l2 {

// ioctl, again where a signal broke it off.
inline int Ask(int fd, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ::ioctl(fd, request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

// For what the system just said in errno.
[[noreturn]] inline void ThrowRefusal(const std::string& what, const std::string& where) {
  const int code = errno;
  std::string advice;
  if (code == EBUSY) advice = "Another program uses the camera; end it first";
  if (code == EACCES || code == EPERM) advice = "Members of the group \"video\" may usually open cameras";
  throw Error(fmt::format("{} ({})", what, std::strerror(code)), where, advice);
}

// Of a field of bytes that ends with a zero.
template <class T>
std::string TextOf(const T& text) {
  return reinterpret_cast<const char*>(text);
}

// How the device captures: V4L2_BUF_TYPE_VIDEO_CAPTURE, where it must be V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE
// (raw pictures have one plane in both), 0 where it does not.
inline std::uint32_t CaptureType(const v4l2_capability& capability) {
  const std::uint32_t can =
      capability.capabilities & V4L2_CAP_DEVICE_CAPS ? capability.device_caps : capability.capabilities;
  if (!(can & V4L2_CAP_STREAMING)) return 0;
  if (can & V4L2_CAP_VIDEO_CAPTURE) return V4L2_BUF_TYPE_VIDEO_CAPTURE;
  return can & V4L2_CAP_VIDEO_CAPTURE_MPLANE ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : 0;
}

}  // namespace polarscan::v4l2
