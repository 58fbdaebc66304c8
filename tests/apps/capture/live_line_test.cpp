// SPDX-License-Identifier: Apache-2.0
// The line that a recording draws over itself on a terminal.
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "apps/terminal/terminal.h"
#include "capture/capture_program.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

// What a program writes to a terminal of so many columns, until it ends.
std::string OnTerminal(const Words& words, unsigned short columns) {
  const winsize size{24, columns, 0, 0};
  int terminal = -1;
  const pid_t child = ::forkpty(&terminal, nullptr, nullptr, &size);
  if (child == 0) {
    ::setenv("TERM", "xterm", 1);
    std::vector<char*> argv;
    for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  std::string text;
  char buffer[4096];
  for (ssize_t n; (n = ::read(terminal, buffer, sizeof buffer)) > 0;) text.append(buffer, std::size_t(n));
  int status = 0;
  ::waitpid(child, &status, 0);
  ::close(terminal);
  EXPECT_EQ(status, 0) << text;
  return text;
}

// The lines that are drawn over each other.
std::vector<std::string> LiveLines(const std::string& text) {
  const std::string redraw = "\r\x1b[K";
  std::vector<std::string> lines;
  for (std::size_t at = text.find(redraw); at != std::string::npos;) {
    const std::size_t begin = at + redraw.size();
    at = text.find(redraw, begin);
    const std::string line = text.substr(begin, at - begin);
    if (at != std::string::npos && !line.empty() && line.find('\n') == std::string::npos)
      lines.push_back(line);
  }
  return lines;
}

TEST_F(CaptureProgram, TheLiveLineIsNoWiderThanItsTerminal) {
  for (const unsigned short columns : {20, 40, 80}) {
    fs::remove_all(session());
    const Words words = CaptureWords(session(), {"--set", "fps=50", "--seconds", "1.5"});
    const std::vector<std::string> lines = LiveLines(OnTerminal(Polarscan(words), columns));
    ASSERT_GT(lines.size(), 4u);
    for (const std::string& line : lines) EXPECT_LT(line.size(), columns) << line;
    const auto has = [&](const char* part) {
      return std::ranges::any_of(lines, [&](const auto& line) { return line.find(part) != line.npos; });
    };
    EXPECT_TRUE(has(" frames/s"));
    EXPECT_EQ(has(" stored"), columns >= 40);
  }
}

TEST(TerminalLine, IsCutBehindAWholePart) {
  EXPECT_EQ(FitTo("  24.0 frames/s, 120.0 MB/s", 27), "  24.0 frames/s, 120.0 MB/s");
  EXPECT_EQ(FitTo("  24.0 frames/s, 120.0 MB/s", 26), "  24.0 frames/s");
  EXPECT_EQ(FitTo("  24.0 frames/s, 120.0 MB/s", 15), "  24.0 frames/s");
  EXPECT_EQ(FitTo("  24.0 frames/s, 120.0 MB/s", 14), "  24.0");
  EXPECT_EQ(FitTo("abcdefgh", 3), "abc");
  EXPECT_EQ(FitTo("abc", 0), "");
}

TEST(TerminalLine, CountsColumnsAndNotBytes) {
  EXPECT_EQ(FitTo("\xC3\xA4\xC3\xB6\xC3\xBC", 3), "\xC3\xA4\xC3\xB6\xC3\xBC");  // a, o, u with dots
  EXPECT_EQ(FitTo("\xE5\x9C\x96\xE5\x83\x8F", 3), "\xE5\x9C\x96");              // two wide ones
  EXPECT_EQ(FitTo("e\xCC\x81"
                  "f",
                  2),
            "e\xCC\x81"
            "f");                                 // an accent of its own
  EXPECT_EQ(FitTo("a\nb\x1b[2J", 10), "ab[2J");   // no orders to the terminal
  EXPECT_EQ(FitTo("\xFF\xE5z", 3), "\xFF\xE5z");  // no UTF-8 at all
}

}  // namespace
}  // namespace polarscan::test
