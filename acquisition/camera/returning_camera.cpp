// SPDX-License-Identifier: Apache-2.0
#include "acquisition/camera/returning_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "core/error.h"

namespace polarscan {
namespace {

constexpr std::chrono::milliseconds kFirstPause{500}, kLongestPause{5000};

}  // namespace

void ReturningCamera::Set(const std::string& feature, const std::string& value) {
  Apply(feature, value);
  std::erase_if(settings_, [&](const auto& setting) { return setting.first == feature; });
  settings_.emplace_back(feature, value);
}

bool ReturningCamera::IsSet(const std::string& feature) const {
  return std::ranges::any_of(settings_, [&](const auto& setting) { return setting.first == feature; });
}

void ReturningCamera::Start(Progress& progress) {
  progress_ = &progress;
  Begin(false);
}

Delivery ReturningCamera::Next(Frame& frame, std::chrono::milliseconds timeout) {
  if (!gone_) return Receive(frame, timeout);
  std::this_thread::sleep_until(std::min(next_try_, Clock::now() + timeout));
  if (Clock::now() < next_try_) return Delivery::kNothing;
  try {
    if (!Reopen(timeout)) return Delivery::kNothing;
    for (const auto& [feature, value] : settings_) Apply(feature, value);
    Begin(true);
  } catch (const Error& error) {
    Close();
    TryAgainLater();
    progress_->Info(error.what());
    return Delivery::kNothing;
  }
  gone_ = false;
  const double seconds = std::chrono::duration<double>(Clock::now() - left_).count();
  progress_->Warn(fmt::format("the camera is back after {:.1f} s", seconds));
  frame.info = {};
  frame.info.sequence = base_ = last_ ? *last_ + 1 : 0;
  frame.info.name = fmt::format("camera gone for {:.1f} s", seconds);
  return Delivery::kRestarted;
}

void ReturningCamera::Leave(const std::string& reason) {
  progress_->Warn(fmt::format("the camera is gone ({}); looking for it", reason));
  Close();
  gone_ = true;
  left_ = Clock::now();
  pause_ = kFirstPause;
  next_try_ = left_ + pause_;
}

void ReturningCamera::TryAgainLater() {
  pause_ = std::min(2 * pause_, kLongestPause);
  next_try_ = Clock::now() + pause_;
}

}  // namespace polarscan
