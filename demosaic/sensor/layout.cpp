// SPDX-License-Identifier: Apache-2.0
#include "demosaic/sensor/layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <vector>

#include "core/error.h"

namespace polarscan {
namespace {

std::vector<std::string> Words(const std::string& text) {
  std::vector<std::string> words(1);
  for (const char c : text) {
    if (c == ' ' || c == ',' || c == '/' || c == ';' || c == '\t') {
      if (!words.back().empty()) words.emplace_back();
    } else {
      words.back() += char(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

[[noreturn]] void ThrowBadLayout(const std::string& text) {
  throw Error("this is not a mosaic layout", fmt::format("\"{}\"", text),
              "Give the polarizer angles of the 2x2 cell row by row from the top-left pixel, as in \"90 45 / "
              "135 0\"; for a colour sensor with its Bayer order, as in \"90 45 / 135 0 rggb\"");
}

bool IsBayerOrder(const std::string& word) {
  return word == "rggb" || word == "bggr" || word == "grbg" || word == "gbrg";
}

}  // namespace

Layout ParseLayout(const std::string& text) {
  const std::vector<std::string> words = Words(text);
  if (words.size() < 4 || words.size() > 5) ThrowBadLayout(text);
  Layout layout;
  for (std::size_t i = 0; i < 4; ++i) {
    if (words[i] != "0" && words[i] != "45" && words[i] != "90" && words[i] != "135") ThrowBadLayout(text);
    layout.angles_deg[i] = std::stoi(words[i]);
  }
  std::array<int, 4> sorted = layout.angles_deg;
  std::ranges::sort(sorted);
  if (sorted != std::array<int, 4>{0, 45, 90, 135}) ThrowBadLayout(text);
  if (words.size() == 5) {
    if (!IsBayerOrder(words[4])) ThrowBadLayout(text);
    layout.bayer = words[4];
  }
  return layout;
}

std::string ToString(const Layout& layout) {
  const auto& a = layout.angles_deg;
  const std::string angles = fmt::format("{} {} / {} {}", a[0], a[1], a[2], a[3]);
  return layout.bayer.empty() ? angles : angles + " " + layout.bayer;
}

}  // namespace polarscan
