// SPDX-License-Identifier: Apache-2.0
#include "apps/capture_screen.h"

#include <fmt/format.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <system_error>

#include "acquisition/live_view.h"
#include "demosaic/pixel_format.h"

namespace polarscan {
namespace {

constexpr double kRateOver_s = 2;

std::uint64_t Received(const FrameCounts& counts) { return counts.stored + counts.pending + counts.dropped; }

}  // namespace

void CaptureScreen::Show(const CaptureStatus& status) {
  const double passed = status.seconds - before_.seconds;
  if (passed >= kRateOver_s || before_.seconds == 0) {
    frames_per_s_ = double(Received(status.counts) - Received(before_.counts)) / std::max(passed, 1e-3);
    bytes_per_s_ = double(status.counts.bytes - before_.counts.bytes) / std::max(passed, 1e-3);
    before_ = status;
  }
  std::string line =
      fmt::format("  {:.1f} frames/s, {:.1f} MB/s, {} stored, {} lost, {} dropped", frames_per_s_,
                  bytes_per_s_ / 1e6, status.counts.stored, status.counts.lost, status.counts.dropped);
  std::error_code code;
  const auto space = std::filesystem::space(folder_, code);
  if (!code && bytes_per_s_ > 0)
    line += ", disk for " + FormatDuration(double(space.available) / bytes_per_s_);
  terminal_.Status(line + look_);
}

void CaptureScreen::Look(const Frame& frame) {
  const auto format = FindPixelFormat(frame.info.pixel_format);
  if (!format) return;
  const Layout layout = sensor_.contains("layout") ? ParseLayout(sensor_["layout"]) : Layout{};
  const LiveView view = LookAt(frame, layout, sensor_.value("bits", format->bits), 64);
  look_ = fmt::format(", clipped {:.1f} {:.1f} {:.1f} {:.1f} %, sharpness {:.2f}", 100 * view.clipped[0],
                      100 * view.clipped[1], 100 * view.clipped[2], 100 * view.clipped[3], view.sharpness);
  if (std::isfinite(frame.info.temperature_c))
    look_ += fmt::format(", {:.0f} degrees C", frame.info.temperature_c);
  for (const auto& [cause, words] : Advice(view))
    if (advised_.insert(cause).second) terminal_.Info(words);
}

struct Keyboard::Saved {
  termios settings;
};

Keyboard::Keyboard() {
  termios settings;
  if (!isatty(STDIN_FILENO) || tcgetattr(STDIN_FILENO, &settings) != 0) return;
  saved_ = std::make_unique<Saved>(Saved{settings});
  settings.c_lflag &= ~tcflag_t(ICANON | ECHO);
  tcsetattr(STDIN_FILENO, TCSANOW, &settings);
}

Keyboard::~Keyboard() {
  if (saved_) tcsetattr(STDIN_FILENO, TCSANOW, &saved_->settings);
}

CaptureHooks::Key Keyboard::Pressed() {
  using Key = CaptureHooks::Key;
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (poll(&input, 1, 0) <= 0) return Key::kNone;
  char key = 0;
  if (read(STDIN_FILENO, &key, 1) != 1) return Key::kQuit;
  return key == ' ' ? Key::kShot : key == 'q' ? Key::kQuit : Key::kNone;
}

}  // namespace polarscan
