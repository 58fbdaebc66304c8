// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "acquisition/camera/camera.h"

namespace polarscan {

// What real cameras have in common: they may go away. Then Next looks for them, soon at first and ever more
// rarely later, gives them their settings back in the order in which they were given, and goes on
// (Delivery::kRestarted) with frame numbers that go on too.
class ReturningCamera : public Camera {
 public:
  void Set(const std::string& feature, const std::string& value) final;
  void Start(Progress& progress) final;
  Delivery Next(Frame& frame, std::chrono::milliseconds timeout) final;

 protected:
  // Throws Error if there is no such feature or its value is not allowed.
  virtual void Apply(const std::string& feature, const std::string& value) = 0;
  // Checks the settings and starts the stream. again: after a return; throws Error if frames would be other
  // ones than before.
  virtual void Begin(bool again) = 0;
  // As Next. Frames are numbered by Number. Calls Leave when the camera is gone.
  virtual Delivery Receive(Frame& frame, std::chrono::milliseconds timeout) = 0;
  // Lets go of the device.
  virtual void Close() = 0;
  // Opens the same camera again; false if that takes longer, then it is called once more. Throws Error if it
  // is not there.
  virtual bool Reopen(std::chrono::milliseconds timeout) = 0;

  // Closes the camera; from now on Next looks for it.
  void Leave(const std::string& reason);
  // The number of a frame that is the n-th (from 0) since the camera started or returned.
  std::uint64_t Number(std::uint64_t n) {
    last_ = base_ + n;
    return *last_;
  }
  // Whether the user has set it.
  bool IsSet(const std::string& feature) const;
  Progress& progress() const { return *progress_; }
  using Clock = std::chrono::steady_clock;

 private:
  void TryAgainLater();

  std::vector<std::pair<std::string, std::string>> settings_;
  Progress* progress_ = nullptr;
  bool gone_ = false;
  Clock::time_point left_, next_try_;
  std::chrono::milliseconds pause_{};
  std::uint64_t base_ = 0;
  std::optional<std::uint64_t> last_;  // number
};

}  // namespace polarscan
