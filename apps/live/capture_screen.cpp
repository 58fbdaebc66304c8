// SPDX-License-Identifier: Apache-2.0
#include "apps/live/capture_screen.h"

#include "core/words.h"

#include <fmt/format.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <system_error>

#include "acquisition/input/options.h"
#include "acquisition/live_picture.h"
#include "demosaic/sensor/pixel_format.h"

namespace polarscan {
namespace {

constexpr double kRateOver_s = 2;
constexpr int kPreviewSide = 640;

std::uint64_t Received(const FrameCounts& counts) {
  return counts.stored + counts.pending + counts.dropped + counts.cancelled;
}

// For a look only: what is not known is assumed. bits: of the frame's samples.
Sensor SensorFor(const nlohmann::json& known, int bits) {
  const InputOptions said = WithSensorJson({.bits = bits}, known, "session.json");
  Sensor sensor;
  if (!said.layout.empty()) sensor.layout = ParseLayout(said.layout);
  sensor.bits = bits;
  sensor.black_dn = std::max(0.0, said.black_level);
  sensor.white_dn = said.white_level > 0 ? said.white_level : std::ldexp(1.0, bits) - 1;
  return sensor;
}

}  // namespace

CaptureScreen::CaptureScreen(Terminal& terminal, const std::filesystem::path& folder, bool on_key,
                             Preview* preview)
    : terminal_(terminal),
      folder_(folder),
      preview_(preview),
      numbers_(
          {{"session", folder.string()}, {"on_key", on_key}, {"frames_per_s", 0.0}, {"bytes_per_s", 0.0}}) {}

void CaptureScreen::Show(const CaptureStatus& status) {
  UpdateRates(status);
  numbers_["counts"] = ToJson(status.counts);
  numbers_["seconds"] = status.seconds;
  numbers_["shots"] = status.shots;
  if (preview_) preview_->Show(numbers_);
  terminal_.Status(Line());
}

void CaptureScreen::UpdateRates(const CaptureStatus& status) {
  const double passed = status.seconds - before_.seconds;
  if (passed < kRateOver_s && before_.seconds > 0) return;
  const auto rate = [&](std::uint64_t now, std::uint64_t then) {
    return double(now - then) / std::max(passed, 1e-3);
  };
  const double bytes_per_s = rate(status.counts.bytes, before_.counts.bytes);
  numbers_["frames_per_s"] = rate(Received(status.counts), Received(before_.counts));
  numbers_["bytes_per_s"] = bytes_per_s;
  std::error_code code;
  const auto space = std::filesystem::space(folder_, code);
  if (!code && bytes_per_s > 0) numbers_["disk_s"] = double(space.available) / bytes_per_s;
  before_ = status;
}

std::string CaptureScreen::Line() const {
  const nlohmann::json& counts = numbers_["counts"];
  std::string line =
      fmt::format("  {:.1f} frames/s, {:.1f} MB/s, {} stored, {} lost, {} dropped",
                  numbers_["frames_per_s"].get<double>(), numbers_["bytes_per_s"].get<double>() / 1e6,
                  counts["stored"].get<int>(), counts["lost"].get<int>(), counts["dropped"].get<int>());
  if (numbers_.contains("disk_s")) line += ", disk for " + FormatDuration(numbers_["disk_s"]);
  if (!numbers_.contains("look")) return line;
  const nlohmann::json& look = numbers_["look"];
  line += ", clipped";
  for (const double share : look["clipped"]) line += fmt::format(" {:.1f}", 100 * share);
  line += fmt::format(" %, sharpness {:.2f}", look["sharpness"].get<double>());
  if (look.contains("temperature_c"))
    line += fmt::format(", {:.0f} degrees C", look["temperature_c"].get<double>());
  return line;
}

void CaptureScreen::Look(const Frame& frame, const nlohmann::json& sensor) {
  const auto format = FindPixelFormat(frame.info.pixel_format);
  if (!format) return;
  const LivePicture view = LookAt(frame, SensorFor(sensor, format->bits), kPreviewSide);
  const auto advice = Advice(view);
  nlohmann::json& look = numbers_["look"];
  look = {
      {"clipped", view.clipped}, {"level", view.level}, {"sharpness", view.sharpness}, {"advice", advice}};
  if (std::isfinite(frame.info.temperature_c)) look["temperature_c"] = frame.info.temperature_c;
  if (preview_) preview_->Look(view);
  for (const auto& [cause, words] : advice)
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
