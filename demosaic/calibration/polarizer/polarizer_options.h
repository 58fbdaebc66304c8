// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "core/options.h"
#include "demosaic/calibration/polarizer/polarizer_light.h"

namespace polarscan {

struct PolarizerOptions {
  std::string angles = "unknown";
  std::string zero = "sensor";
  double degree = 1;
  bool shading = false;
};
OptionTable Table(PolarizerOptions& options);

// What the options say about frames of these names. Throws Error if the angles are no such thing, or not as
// many as the frames.
PolarizerKnowledge KnowledgeOf(const PolarizerOptions& options, const std::vector<std::string>& names);

}  // namespace polarscan
