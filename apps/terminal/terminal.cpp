// SPDX-License-Identifier: Apache-2.0
#include "apps/terminal/terminal.h"

#include "core/words.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
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

// Of stderr, now: a window may change its size at any time.
int TerminalColumns() {
  constexpr int kUnknown = 80;
  winsize size{};
  if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  const char* columns = std::getenv("COLUMNS");
  const int number = columns ? std::atoi(columns) : 0;
  return number > 0 ? number : kUnknown;
}

// The character that begins at a byte of UTF-8 text, and its bytes; a byte that begins none counts as one.
std::pair<char32_t, std::size_t> CharacterAt(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return at + i < text.size() ? std::uint8_t(text[at + i]) : 0u; };
  const unsigned first = byte(0);
  const std::size_t bytes = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : first >= 0xc2 ? 2 : 1;
  char32_t character = bytes == 1 ? first : first & (0x7fu >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return {U'?', 1};
    character = character << 6 | (byte(i) & 0x3f);
  }
  return {character, bytes};
}

// Columns that a terminal gives a character: after Unicode's East Asian Width.
int ColumnsOf(char32_t c) {
  struct Range {
    char32_t first, last;
  };
  constexpr Range kNoColumn[] = {{0, 0x1f},        {0x7f, 0x9f},     {0x300, 0x36f},
                                 {0x200b, 0x200f}, {0x20d0, 0x20ff}, {0xfe00, 0xfe0f}};
  constexpr Range kTwoColumns[] = {{0x1100, 0x115f},   {0x2e80, 0x303e},  {0x3041, 0xa4cf},
                                   {0xac00, 0xd7a3},   {0xf900, 0xfaff},  {0xfe30, 0xfe6f},
                                   {0xff00, 0xff60},   {0xffe0, 0xffe6},  {0x1f300, 0x1f64f},
                                   {0x1f900, 0x1f9ff}, {0x20000, 0x3fffd}};
  const auto holds = [c](const Range& range) { return c >= range.first && c <= range.last; };
  return std::ranges::any_of(kNoColumn, holds) ? 0 : std::ranges::any_of(kTwoColumns, holds) ? 2 : 1;
}

// What stderr does not take (a full disk, a closed pipe) is lost: the work goes on.
void Put(const std::string& text) {
  std::fputs(text.c_str(), stderr);
  std::fflush(stderr);
}

const char* Article(const std::string& unit) {
  return std::string("aeiou").find(unit[0]) == std::string::npos ? "a" : "an";
}

// Symbols ("MB") have none.
std::string Plural(const std::string& unit) {
  const bool symbol = !unit.empty() && std::isupper(static_cast<unsigned char>(unit.back()));
  return unit + (symbol || unit.ends_with('s') ? "" : "s");
}

}  // namespace

std::string FitTo(const std::string& line, int columns) {
  std::string text;
  int used = 0;
  for (std::size_t at = 0; at < line.size();) {
    const auto [character, bytes] = CharacterAt(line, at);
    used += ColumnsOf(character);
    if (used > columns) {
      if (character == ',') return text;
      const std::size_t part = text.rfind(", "), word = text.find_last_of(' ');
      const std::size_t end = part != std::string::npos ? part : word;
      return end != std::string::npos && text.find_first_not_of(' ') < end ? text.substr(0, end) : text;
    }
    const bool control = character < 0x20 || (character >= 0x7f && character < 0xa0);
    if (!control) text += line.substr(at, bytes);
    at += bytes;
  }
  return text;
}

Terminal::Terminal() : coloured_(WantsColour()), in_place_(IsTerminal()) {
  clock_ = std::jthread([this](std::stop_token stop) { ShowNowAndThen(std::move(stop)); });
}

Terminal::~Terminal() {
  clock_.request_stop();
  clock_.join();
  ClearLine();
}

void Terminal::SetLevel(Level level) {
  level_ = level;
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
    Draw(ProgressLine());
  } else {
    if (step_begins) shown_ = now;
    if (now - shown_ < kPlainLine) return;
    Print(Kind::kInfo, ProgressLine());
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
                    : fmt::format(", {:.1f} s {} {}", 1 / rate, Article(unit_), unit_);
  if (done_ < total_) line += fmt::format(", {} left", FormatDuration(double(total_ - done_) / rate));
  return line;
}

// The last column stays free: a cursor behind it may be on the next line already.
void Terminal::Draw(const std::string& line) {
  Put("\r\x1b[K" + FitTo(line, TerminalColumns() - 1));
  line_shown_ = true;
}

void Terminal::ClearLine() {
  if (!line_shown_) return;
  Put("\r\x1b[K");
  line_shown_ = false;
}

void Terminal::Print(Kind kind, const std::string& message) {
  constexpr const char *kYellow = "\x1b[33m\x1b[1m", *kRed = "\x1b[31m\x1b[1m", *kPlain = "\x1b[m";
  ClearLine();
  if (kind == Kind::kInfo && level_ == Level::kQuiet) return;
  if (kind == Kind::kInfo || !coloured_)
    Put(message + "\n");
  else
    Put((kind == Kind::kError ? kRed : kYellow) + message + kPlain + "\n");
}

void Terminal::Warn(const std::string& message) {
  const std::lock_guard lock(mutex_);
  Print(Kind::kWarning, "warning: " + message);
  warnings_.push_back(message);
}

void Terminal::Info(const std::string& message) {
  const std::lock_guard lock(mutex_);
  Print(Kind::kInfo, message);
}

void Terminal::Status(const std::string& line) {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  if (in_place_) {
    Draw(line);
  } else if (now - shown_ >= kPlainLine) {
    Print(Kind::kInfo, line);
    shown_ = now;
  }
}

void Terminal::Fail(const std::string& message) {
  const std::lock_guard lock(mutex_);
  Print(Kind::kError, "polarscan: " + message);
}

void Terminal::Say(const std::string& message) {
  const std::lock_guard lock(mutex_);
  ClearLine();
  Put(message + "\n");
}

std::vector<std::string> Terminal::TakeWarnings() {
  const std::lock_guard lock(mutex_);
  return std::exchange(warnings_, {});
}

}  // namespace polarscan
