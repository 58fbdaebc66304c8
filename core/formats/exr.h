// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/image.h"

namespace polarscan {

// The names of an OpenEXR file's channels, sorted: "B", "G", "R", "S0.R". Of a file of several parts those of
// the first. Throws Error if it is none or damaged.
std::vector<std::string> ExrChannels(const std::filesystem::path& path);

// These channels, as float32 whatever they are stored as. Throws Error if one is missing or not of the
// picture's full size, or the file is damaged.
std::vector<Image<float>> ReadExrChannels(const std::filesystem::path& path,
                                          const std::vector<std::string>& names);

}  // namespace polarscan
