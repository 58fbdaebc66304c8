// SPDX-License-Identifier: Apache-2.0
// The raw formats that V4L2 cameras offer, by the names that we have for them.
#pragma once
#include <linux/videodev2.h>

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "acquisition/camera/v4l2/device.h"
#include "core/error.h"

namespace polarscan::v4l2 {

// The raw formats, deepest first (16 bits are most often 12 in a larger container). Linux 6.1 has no names
// for two of them.
struct Fourcc {
  std::uint32_t code;
  const char* name;
};
inline constexpr Fourcc kFormats[] = {{V4L2_PIX_FMT_Y14, "Mono14"},
                                      {V4L2_PIX_FMT_SRGGB14, "BayerRG14"},
                                      {V4L2_PIX_FMT_SGRBG14, "BayerGR14"},
                                      {V4L2_PIX_FMT_SGBRG14, "BayerGB14"},
                                      {V4L2_PIX_FMT_SBGGR14, "BayerBG14"},
                                      {v4l2_fourcc('Y', '1', '4', 'P'), "Mono14csi2p"},
                                      {V4L2_PIX_FMT_SRGGB14P, "BayerRG14csi2p"},
                                      {V4L2_PIX_FMT_SGRBG14P, "BayerGR14csi2p"},
                                      {V4L2_PIX_FMT_SGBRG14P, "BayerGB14csi2p"},
                                      {V4L2_PIX_FMT_SBGGR14P, "BayerBG14csi2p"},
                                      {V4L2_PIX_FMT_Y12, "Mono12"},
                                      {V4L2_PIX_FMT_SRGGB12, "BayerRG12"},
                                      {V4L2_PIX_FMT_SGRBG12, "BayerGR12"},
                                      {V4L2_PIX_FMT_SGBRG12, "BayerGB12"},
                                      {V4L2_PIX_FMT_SBGGR12, "BayerBG12"},
                                      {v4l2_fourcc('Y', '1', '2', 'P'), "Mono12csi2p"},
                                      {V4L2_PIX_FMT_SRGGB12P, "BayerRG12csi2p"},
                                      {V4L2_PIX_FMT_SGRBG12P, "BayerGR12csi2p"},
                                      {V4L2_PIX_FMT_SGBRG12P, "BayerGB12csi2p"},
                                      {V4L2_PIX_FMT_SBGGR12P, "BayerBG12csi2p"},
                                      {V4L2_PIX_FMT_Y16, "Mono16"},
                                      {V4L2_PIX_FMT_SRGGB16, "BayerRG16"},
                                      {V4L2_PIX_FMT_SGRBG16, "BayerGR16"},
                                      {V4L2_PIX_FMT_SGBRG16, "BayerGB16"},
                                      {V4L2_PIX_FMT_SBGGR16, "BayerBG16"},
                                      {V4L2_PIX_FMT_Y10, "Mono10"},
                                      {V4L2_PIX_FMT_SRGGB10, "BayerRG10"},
                                      {V4L2_PIX_FMT_SGRBG10, "BayerGR10"},
                                      {V4L2_PIX_FMT_SGBRG10, "BayerGB10"},
                                      {V4L2_PIX_FMT_SBGGR10, "BayerBG10"},
                                      {V4L2_PIX_FMT_Y10P, "Mono10csi2p"},
                                      {V4L2_PIX_FMT_SRGGB10P, "BayerRG10csi2p"},
                                      {V4L2_PIX_FMT_SGRBG10P, "BayerGR10csi2p"},
                                      {V4L2_PIX_FMT_SGBRG10P, "BayerGB10csi2p"},
                                      {V4L2_PIX_FMT_SBGGR10P, "BayerBG10csi2p"},
                                      {V4L2_PIX_FMT_GREY, "Mono8"},
                                      {V4L2_PIX_FMT_SRGGB8, "BayerRG8"},
                                      {V4L2_PIX_FMT_SGRBG8, "BayerGR8"},
                                      {V4L2_PIX_FMT_SGBRG8, "BayerGB8"},
                                      {V4L2_PIX_FMT_SBGGR8, "BayerBG8"}};

// What the device offers of them, deepest first. type: V4L2_BUF_TYPE_VIDEO_CAPTURE or
// V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE.
inline std::vector<const Fourcc*> OfferedFormats(int fd, std::uint32_t type) {
  std::set<std::uint32_t> codes;
  v4l2_fmtdesc description{};
  description.type = type;
  for (; Ask(fd, VIDIOC_ENUM_FMT, &description) == 0; ++description.index)
    codes.insert(description.pixelformat);
  std::vector<const Fourcc*> offered;
  for (const Fourcc& format : kFormats)
    if (codes.contains(format.code)) offered.push_back(&format);
  return offered;
}

// The name of a format; "another format" of one that is not raw.
inline std::string FormatName(std::uint32_t code) {
  for (const Fourcc& format : kFormats)
    if (format.code == code) return format.name;
  return "another format";
}

// Throws Error if the device does not offer a format of this name.
inline std::uint32_t CodeOf(int fd, std::uint32_t type, const std::string& name) {
  std::string offered;
  for (const Fourcc* format : OfferedFormats(fd, type)) {
    if (name == format->name) return format->code;
    offered += std::string(offered.empty() ? "" : ", ") + format->name;
  }
  throw Error("the camera has no such pixel format", name, "It has " + offered);
}

}  // namespace polarscan::v4l2
