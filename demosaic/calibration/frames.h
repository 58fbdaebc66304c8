// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/image.h"

namespace polarscan {

// The frames of a calibration, read when they are needed. A frame may be asked for twice.
struct CalibrationFrames {
  std::vector<std::string> names;
  std::function<Image<float>(int frame)> counts;  // as stored

  int size() const { return int(names.size()); }
};

// Throws Error that names the frame if more than a share of its samples is clipped.
void RequireExposed(const Image<std::uint8_t>& clipped, double most, const std::string& frame);

}  // namespace polarscan
