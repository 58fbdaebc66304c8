// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/progress.h"

namespace polarscan {

// Messages and progress on stderr. On a terminal the current step is one line that is redrawn in place, with
// its rate and remaining time, as much of it as the terminal is wide; elsewhere (a file, a pipe, TERM=dumb) a
// plain line now and then. Both go on while a step says nothing of itself, so that nobody takes a long one
// for a hang. Colours only on a terminal and without NO_COLOR. Warnings are kept until they are taken (they
// end up in scan.json).
class Terminal : public Progress {
 public:
  enum class Level { kQuiet, kNormal, kVerbose };  // quiet: warnings and errors only

  Terminal();
  ~Terminal() override;
  void SetLevel(Level level);

  void Begin(const std::string& step, std::size_t total, const std::string& unit = "view") override;
  void Advance(std::size_t units = 1) override;
  void Warn(const std::string& message) override;
  void Info(const std::string& message) override;
  void Status(
      const std::string& line);  // instead of a step's progress: redrawn in place, elsewhere now and then
  void Fail(const std::string& message);  // an error, in red
  void Say(const std::string& message);   // shown also with --quiet: a command's result
  void End() override;                    // its line disappears

  std::vector<std::string> TakeWarnings() override;

 private:
  using Clock = std::chrono::steady_clock;
  enum class Kind { kInfo, kWarning, kError };
  void Print(Kind kind, const std::string& message);
  void ShowProgress(bool step_begins);
  void ShowNowAndThen(std::stop_token stop);
  std::string ProgressLine() const;
  void Draw(const std::string& line);
  void ClearLine();

  Level level_ = Level::kNormal;
  bool coloured_ = false;
  bool in_place_ = false;  // stderr is a terminal that can redraw a line
  bool line_shown_ = false;
  std::mutex mutex_;
  std::string step_, unit_;
  std::size_t done_ = 0, total_ = 0;
  Clock::time_point began_, shown_;
  std::vector<std::string> warnings_;
  std::condition_variable_any stop_;
  std::jthread clock_;  // last: it uses the others
};

// As much of the line as takes at most `columns` columns of a terminal (wide characters take two), without
// control characters. Where it must be cut, behind a whole part ("..., "), else a whole word.
std::string FitTo(const std::string& line, int columns);

}  // namespace polarscan
