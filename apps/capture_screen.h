// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <memory>
#include <set>
#include <string>

#include "acquisition/capture.h"
#include "apps/terminal.h"

namespace polarscan {

// The live line of a recording: rates over about the last two seconds, counts, clipped share behind each
// polarizer, sharpness, temperature, and how long the disk lasts.
class CaptureScreen {
 public:
  // sensor: what is known of it, as in session.json.
  CaptureScreen(Terminal& terminal, const std::filesystem::path& folder, const nlohmann::json& sensor)
      : terminal_(terminal), folder_(folder), sensor_(sensor) {}
  void Show(const CaptureStatus& status);
  // How the latest frame looks goes into the line; advice is said once for each cause.
  void Look(const Frame& frame);

 private:
  Terminal& terminal_;
  std::filesystem::path folder_;
  nlohmann::json sensor_;
  std::string look_;
  std::set<std::string> advised_;
  CaptureStatus before_;
  double frames_per_s_ = 0, bytes_per_s_ = 0;
};

// The keyboard while a recording waits for key presses: a terminal gives them at once and without echo, as
// long as this lives; of a pipe every byte is a key and its end is q.
class Keyboard {
 public:
  Keyboard();
  ~Keyboard();
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;
  CaptureHooks::Key Pressed();  // does not wait

 private:
  struct Saved;
  std::unique_ptr<Saved> saved_;
};

}  // namespace polarscan
