// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <charconv>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace polarscan {

// 0.25 as "0.25"; whole: without fraction or exponent.
std::string NumberText(double value, bool whole);

// "0 to 16", "at least 1", "at most 3"; empty where any number will do (limits beyond 1e299).
std::string RangeText(double min, double max, bool whole);

// The one of `names` that `name` was probably meant to be: at most one letter in three is another, or the
// name holds it. Empty if none is near.
std::string NearestName(const std::string& name, const std::vector<std::string>& names);

bool IsUtf8(const std::string& text);

// ASCII letters only.
std::string LowerCase(std::string text);
// ".png" of a.PNG.
std::string LowerExtension(const std::filesystem::path& path);

// "1 view", "3 views".
std::string CountOf(std::size_t count, const std::string& what);

// "a, b, c and 4 more".
std::string Enumerate(const std::vector<std::string>& names, std::size_t most = 8);

// The whole word as a number, also with a + before it; nothing if it is none.
template <class T>
std::optional<T> ToNumber(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return {};
  return value;
}

// "4 s", "3 min 20 s", "2 h 05 min".
std::string FormatDuration(double seconds);

// Text between the tags of HTML or SVG.
std::string EscapeHtml(const std::string& text);

// Of a file's text, for a message: at most 40 bytes of it, and '?' for what cannot be shown.
std::string Excerpt(std::string_view text);

// What nlohmann::json noticed, for people: its "[json.exception.out_of_range.403] key 'format' not found"
// without the code.
std::string JsonReason(const std::string& what);

}  // namespace polarscan
