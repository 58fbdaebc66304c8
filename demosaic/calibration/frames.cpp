// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/frames.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"

namespace polarscan {

void RequireExposed(const Image<std::uint8_t>& clipped, double most, const std::string& frame) {
  const auto count = std::ranges::count(clipped.pixels(), std::uint8_t(1));
  const double share = double(count) / double(clipped.size());
  if (share > most)
    throw Error(share > 0.999 ? "every sample of this frame is clipped"
                              : fmt::format("{:.0f} % of this frame's samples are clipped", 100 * share),
                frame, "Expose less: the brightest samples should stay at about 80 % of full scale");
}

}  // namespace polarscan
