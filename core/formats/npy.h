// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "core/image.h"

namespace polarscan {

// bits: 8 or 16 of counts (uint8, uint16), 32 of floating point.
struct NpyArray {
  std::vector<Image<float>> planes;
  int bits = 32;
};

// An array that numpy saved: height x width, or height x width x channels, as one plane a channel. float16,
// float32, float64, uint8 or uint16, little-endian, C order. Throws Error if the file is none of these, or
// damaged.
NpyArray ReadNpy(const std::filesystem::path& path);

}  // namespace polarscan
