// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <chrono>
#include <thread>

namespace polarscan {

// Says when the frames of a made-up camera are due.
class Pacer {
 public:
  using Clock = std::chrono::steady_clock;
  // Waits until `seconds` after Start have passed, at most `timeout`; false if they have not.
  bool WaitUntil(double seconds, std::chrono::milliseconds timeout) const {
    const auto due =
        begin_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    const auto limit = Clock::now() + timeout;
    std::this_thread::sleep_until(std::min(due, limit));
    return due <= limit;
  }
  double Seconds() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }
  void Start() { begin_ = Clock::now(); }

 private:
  Clock::time_point begin_ = Clock::now();
};

// Unix time.
inline std::int64_t HostTimeNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace polarscan
