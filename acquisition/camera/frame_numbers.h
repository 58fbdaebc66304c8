// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

namespace polarscan {

// Frame numbers as they come (GigE Vision: 16 bits, 0 is left out at the wrap; or 64 bits) made one count
// that starts at 0, also where the first few frames never came. Where a camera does not begin at the
// beginning, the first frame to come is 0. A number from the past gives a count from the past.
class FrameNumbers {
 public:
  explicit FrameNumbers(bool gige) : gige_(gige) {}
  std::uint64_t Unwrap(std::uint64_t number);

 private:
  bool gige_, first_ = true;
  std::uint64_t last_number_ = 0, last_ = 0;
};

}  // namespace polarscan
