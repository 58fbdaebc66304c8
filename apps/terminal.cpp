// SPDX-License-Identifier: Apache-2.0
#include "apps/terminal.h"

#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>

namespace polarscan {
namespace {

constexpr auto kRedraw = std::chrono::milliseconds(100);
constexpr auto kPlainLine = std::chrono::seconds(20);
constexpr auto kTick = std::chrono::seconds(1);
constexpr double kSilence = 3;  // s of a step after which its line says how long it has taken

bool IsTerminal() {
  const char* term = std::getenv("TERM");
  return isatty(STDERR_FILENO) && term && std::string_view(term) != "dumb";
}

bool WantsColour() {
  const char* no_color = std::getenv("NO_COLOR");
  return IsTerminal() && !(no_color && *no_color);
}

double Seconds(std::chrono::steady_clock::duration d) { return std::chrono::duration<double>(d).count(); }

std::string Plural(const std::string& unit) { return unit + (unit.ends_with('s') ? "" : "s"); }

}  // namespace

std::string FormatDuration(double seconds) {
  const long s = std::lround(std::max(seconds, 0.0));
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} h {:02} min", s / 3600, s % 3600 / 60);
}

Terminal::Terminal() : in_place_(IsTerminal()) {
  const auto mode = WantsColour() ? spdlog::color_mode::always : spdlog::color_mode::never;
  auto sink = std::make_shared<spdlog::sinks::stderr_color_sink_mt>(mode);
  sink->set_color(spdlog::level::info, sink->reset);
  log_ = std::make_shared<spdlog::logger>("polarscan", sink);
  log_->set_pattern("%^%v%$");
  clock_ = std::jthread([this](std::stop_token stop) { ShowNowAndThen(std::move(stop)); });
}

Terminal::~Terminal() {
  clock_.request_stop();
  clock_.join();
  ClearLine();
}

void Terminal::SetLevel(Level level) {
  log_->set_level(level == Level::kQuiet     ? spdlog::level::warn
                  : level == Level::kVerbose ? spdlog::level::debug
                                             : spdlog::level::info);
  if (level == Level::kQuiet) in_place_ = false;
}

void Terminal::Begin(const std::string& step, std::size_t total, const std::string& unit) {
  const std::lock_guard lock(mutex_);
  step_ = step;
  unit_ = unit;
  done_ = 0;
  total_ = total;
  began_ = Clock::now();
  ShowProgress(true);
}

void Terminal::Advance(std::size_t units) {
  const std::lock_guard lock(mutex_);
  done_ += units;
  ShowProgress(false);
}

void Terminal::End() {
  const std::lock_guard lock(mutex_);
  ClearLine();
  step_.clear();
}

void Terminal::ShowNowAndThen(std::stop_token stop) {
  std::unique_lock lock(mutex_);
  while (!stop_.wait_for(lock, stop, kTick, [] { return false; }) && !stop.stop_requested())
    ShowProgress(false);
}

// Redraws the line on a terminal (at most every 100 ms); elsewhere prints a line every 20 s.
void Terminal::ShowProgress(bool step_begins) {
  if (step_.empty()) return;
  const auto now = Clock::now();
  if (in_place_) {
    if (!step_begins && done_ < total_ && now - shown_ < kRedraw) return;
    fmt::print(stderr, "\r\x1b[K{}", ProgressLine());
    std::fflush(stderr);
    line_shown_ = true;
  } else {
    if (step_begins) shown_ = now;
    if (now - shown_ < kPlainLine) return;
    log_->info(ProgressLine());
  }
  shown_ = now;
}

std::string Terminal::ProgressLine() const {
  const double seconds = Seconds(Clock::now() - began_);
  const std::string so_far = seconds < kSilence ? "" : fmt::format(", {} so far", FormatDuration(seconds));
  if (total_ == 0) return fmt::format("  {} ...{}", step_, so_far);
  std::string line = fmt::format("  {}: {} of {} {}", step_, done_, total_, Plural(unit_));
  if (done_ == 0 || seconds < 0.5) return line + so_far;
  const double rate = double(done_) / seconds;
  line += rate >= 1 ? fmt::format(", {:.1f} {}/s", rate, Plural(unit_))
                    : fmt::format(", {:.1f} s a {}", 1 / rate, unit_);
  if (done_ < total_) line += fmt::format(", {} left", FormatDuration(double(total_ - done_) / rate));
  return line;
}

void Terminal::ClearLine() {
  if (!line_shown_) return;
  fmt::print(stderr, "\r\x1b[K");
  std::fflush(stderr);
  line_shown_ = false;
}

void Terminal::Show(spdlog::level::level_enum level, const std::string& message) {
  ClearLine();
  log_->log(level, message);
}

void Terminal::Warn(const std::string& message) {
  const std::lock_guard lock(mutex_);
  Show(spdlog::level::warn, "warning: " + message);
  warnings_.push_back(message);
}

void Terminal::Info(const std::string& message) {
  const std::lock_guard lock(mutex_);
  Show(spdlog::level::info, message);
}

void Terminal::Status(const std::string& line) {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  if (in_place_) {
    fmt::print(stderr, "\r\x1b[K{}", line);
    std::fflush(stderr);
    line_shown_ = true;
  } else if (now - shown_ >= kPlainLine) {
    log_->info(line);
    shown_ = now;
  }
}

void Terminal::Fail(const std::string& message) {
  const std::lock_guard lock(mutex_);
  Show(spdlog::level::err, "polarscan: " + message);
}

void Terminal::Say(const std::string& message) {
  const std::lock_guard lock(mutex_);
  ClearLine();
  fmt::print(stderr, "{}\n", message);
}

std::vector<std::string> Terminal::TakeWarnings() {
  const std::lock_guard lock(mutex_);
  return std::exchange(warnings_, {});
}

}  // namespace polarscan
