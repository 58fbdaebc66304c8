// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <memory>
#include <set>
#include <string>

#include "acquisition/capture.h"
#include "apps/live/preview.h"
#include "apps/terminal/terminal.h"

namespace polarscan {

// A recording as a person sees it: rates over about the last two seconds, counts, clipped share behind each
// polarizer, sharpness, temperature, and how long the disk lasts. In a line on the terminal, and in the
// preview if there is one.
class CaptureScreen {
 public:
  // preview may be null.
  CaptureScreen(Terminal& terminal, const std::filesystem::path& folder, bool on_key, Preview* preview);
  void Show(const CaptureStatus& status);
  // How the latest frame looks; advice is said once for each cause. sensor: as in session.json.
  void Look(const Frame& frame, const nlohmann::json& sensor);

 private:
  void UpdateRates(const CaptureStatus& status);
  std::string Line() const;

  Terminal& terminal_;
  std::filesystem::path folder_;
  Preview* preview_;
  nlohmann::json numbers_;  // what Preview::Show takes
  std::set<std::string> advised_;
  CaptureStatus before_;
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
