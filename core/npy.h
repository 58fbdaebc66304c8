// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "core/image.h"

namespace polarscan {

// An array that numpy saved: height x width, or height x width x channels, as one plane a channel. float16,
// float32, float64, uint8 or uint16, little-endian, C order; all become float32. Throws Error if the file is
// none of these, or damaged.
std::vector<Image<float>> ReadNpy(const std::filesystem::path& path);

}  // namespace polarscan
