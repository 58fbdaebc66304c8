// SPDX-License-Identifier: Apache-2.0
#include "core/words.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

namespace polarscan {
namespace {

// Letters to insert, leave out or replace, and neighbours to swap, until one word is the other.
std::size_t LettersApart(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> cost(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        cost[i][j] = i + j;
        continue;
      }
      cost[i][j] = std::min(
          {cost[i - 1][j] + 1, cost[i][j - 1] + 1, cost[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        cost[i][j] = std::min(cost[i][j], cost[i - 2][j - 2] + 1);
    }
  return cost[a.size()][b.size()];
}

}  // namespace

std::string NumberText(double value, bool whole) {
  return whole ? fmt::format("{}", static_cast<long long>(value)) : fmt::format("{:g}", value);
}

std::string RangeText(double min, double max, bool whole) {
  const bool has_min = min > -1e299, has_max = max < 1e299;
  if (has_min && has_max) return fmt::format("{} to {}", NumberText(min, whole), NumberText(max, whole));
  if (has_min) return "at least " + NumberText(min, whole);
  return has_max ? "at most " + NumberText(max, whole) : "";
}

std::string NearestName(const std::string& name, const std::vector<std::string>& names) {
  if (name.size() < 3) return "";
  std::string nearest;
  std::size_t least = name.size() / 3 + 1;
  for (const std::string& candidate : names)
    if (const std::size_t apart = LettersApart(name, candidate); apart < least)
      nearest = candidate, least = apart;
  if (!nearest.empty()) return nearest;
  const auto longer = std::ranges::find_if(names, [&](const auto& n) { return n.find(name) != n.npos; });
  return longer == names.end() ? "" : *longer;
}

bool IsUtf8(const std::string& text) {
  try {
    nlohmann::json(text).dump();  // refuses what is not
    return true;
  } catch (const nlohmann::json::exception&) {
    return false;
  }
}

std::string LowerCase(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

std::string LowerExtension(const std::filesystem::path& path) { return LowerCase(path.extension().string()); }

std::string CountOf(std::size_t count, const std::string& what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string Enumerate(const std::vector<std::string>& names, std::size_t most) {
  const std::size_t shown = std::min(most, names.size());
  const std::string text =
      fmt::format("{}", fmt::join(names.begin(), names.begin() + std::ptrdiff_t(shown), ", "));
  return shown < names.size() ? fmt::format("{} and {} more", text, names.size() - shown) : text;
}

std::string Excerpt(std::string_view text) {
  std::string excerpt(text.substr(0, 40));
  const bool letters = IsUtf8(excerpt);
  std::ranges::replace_if(
      excerpt, [letters](unsigned char c) { return c < 32 || c == 127 || (c > 127 && !letters); }, '?');
  return text.size() > 40 ? excerpt + "..." : excerpt;
}

std::string FormatDuration(double seconds) {
  const long s = std::lround(std::max(seconds, 0.0));
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} h {:02} min", s / 3600, s % 3600 / 60);
}

std::string EscapeHtml(const std::string& text) {
  std::string escaped;
  for (char c : text) escaped += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  return escaped;
}

std::string JsonReason(const std::string& what) {
  const std::size_t end = what.find("] ");
  return what.starts_with("[json.") && end != std::string::npos ? what.substr(end + 2) : what;
}

}  // namespace polarscan
