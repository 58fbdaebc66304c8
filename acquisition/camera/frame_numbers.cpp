// SPDX-License-Identifier: Apache-2.0
#include "acquisition/camera/frame_numbers.h"

namespace polarscan {
namespace {

constexpr std::uint64_t kMostMissedAtStart = 1000;

}  // namespace

std::uint64_t FrameNumbers::Unwrap(std::uint64_t number) {
  constexpr std::int64_t kCycle = 65535;  // 1 ... 65535
  if (first_) {
    first_ = false;
    last_number_ = number;
    const std::uint64_t begin = gige_ ? 1 : 0;
    return last_ = number >= begin && number < begin + kMostMissedAtStart ? number - begin : 0;
  }
  std::int64_t step = std::int64_t(number - last_number_);
  const bool wraps = gige_ && number <= 65535 && last_number_ <= 65535;
  if (wraps && step < -kCycle / 2) step += kCycle;
  if (wraps && step > kCycle / 2) step -= kCycle;
  const std::int64_t count = std::int64_t(last_) + step;
  if (count < 0) return 0;
  if (step > 0) last_number_ = number, last_ = std::uint64_t(count);
  return std::uint64_t(count);
}

}  // namespace polarscan
