// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <chrono>
#include <thread>

namespace polarscan {

// Says when to look again for a camera that is gone: soon at first, then ever more rarely.
class BackOff {
 public:
  using Clock = std::chrono::steady_clock;

  void Begin() {
    began_ = Clock::now();
    pause_ = kFirst;
    next_ = began_ + pause_;
  }
  // Waits for the next try, at most `timeout`; true when it is due.
  bool WaitUntilDue(std::chrono::milliseconds timeout) const {
    std::this_thread::sleep_until(std::min(next_, Clock::now() + timeout));
    return Clock::now() >= next_;
  }
  void Failed() {
    pause_ = std::min(2 * pause_, kLongest);
    next_ = Clock::now() + pause_;
  }
  // Since Begin.
  double Seconds() const { return std::chrono::duration<double>(Clock::now() - began_).count(); }

 private:
  static constexpr std::chrono::milliseconds kFirst{500}, kLongest{5000};
  Clock::time_point began_, next_;
  std::chrono::milliseconds pause_ = kFirst;
};

}  // namespace polarscan
