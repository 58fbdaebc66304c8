// SPDX-License-Identifier: Apache-2.0
#include "acquisition/input/forms/angles.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>

#include "core/error.h"
#include "core/words.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

const std::vector<double> kFourAngles = {0, 45, 90, 135};

// The angle that a name in lower case stands for: "i-045", "i45", "45", "pol-22.5", "60deg".
std::optional<double> AngleOf(std::string name) {
  for (const char* word : {"angle", "pol", "i"})
    if (name.starts_with(word) && name.size() > std::string(word).size()) {
      name.erase(0, std::string(word).size());
      if (name[0] == '-' || name[0] == '_') name.erase(0, 1);
      break;
    }
  for (const std::string end : {"deg", "\xC2\xB0"})
    if (name.ends_with(end)) name.resize(name.size() - end.size());
  const bool is_number =
      !name.empty() && name.size() <= 7 && name.find_first_not_of("0123456789.") == std::string::npos;
  double angle = 0;
  if (!is_number ||
      std::from_chars(name.data(), name.data() + name.size(), angle).ptr != name.data() + name.size() ||
      angle > 360)
    return std::nullopt;
  return angle;
}

// NAME and angle of a stem like NAME_60; the name is empty where there is none.
std::optional<std::pair<std::string, double>> SplitStem(const std::string& stem) {
  const std::size_t mark = stem.find_last_of("-_ ");
  const bool has_name = mark != std::string::npos;
  const std::optional<double> angle = AngleOf(LowerCase(has_name ? stem.substr(mark + 1) : stem));
  if (!angle) return std::nullopt;
  return std::pair(has_name ? stem.substr(0, mark) : "", *angle);
}

bool DivideEvenly(const std::vector<double>& angles) {
  for (std::size_t i = 0; i < angles.size(); ++i)
    if (std::abs(angles[i] - 180.0 * double(i) / double(angles.size())) > 0.6) return false;
  return angles.size() >= 3;
}

}  // namespace

std::vector<double> ParseAngles(const std::string& text) {
  std::vector<double> angles;
  const std::string advice = "Give the polarizer's angles in degrees, three or more, as in --angles 0,60,120";
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.size(), text.find_first_of(", /", at));
    if (end > at) {
      double angle = 0;
      const auto [stop, error] = std::from_chars(text.data() + at, text.data() + end, angle);
      if (error != std::errc() || stop != text.data() + end || !(std::abs(angle) <= 3600))
        throw Error("this is no list of angles", text, advice);
      angles.push_back(angle);
    }
    at = end + 1;
  }
  std::set<long> distinct;
  for (const double angle : angles)
    distinct.insert(std::lround((angle - 180 * std::floor(angle / 180)) * 10) % 1800);
  if (distinct.size() < 3) throw Error("three different polarizer angles are needed", text, advice);
  return angles;
}

std::string AnglesText(const std::vector<double>& angles) {
  std::string text;
  for (const double angle : angles) text += fmt::format("{}{:g}", text.empty() ? "" : " ", angle);
  return text;
}

std::string AnglesOption(const std::vector<double>& angles) {
  return fmt::format("--angles {:g}", fmt::join(angles, ","));
}

std::map<double, fs::path> AngleFolders(const fs::path& folder) {
  std::map<double, fs::path> angles;
  for (const auto& [name, path] : ListFolders(folder)) {
    const auto angle = AngleOf(name);
    const bool is_second = angle && !angles.emplace(*angle, path).second;
    if (is_second && std::ranges::find(kFourAngles, *angle) != kFourAngles.end())
      throw Error(fmt::format("two folders hold the angle {:g}", *angle), folder.string(),
                  "Remove one of them");
  }
  return angles;
}

std::vector<double> AnglesOfFolders(const fs::path& folder) {
  std::vector<double> all;
  const auto folders = AngleFolders(folder);
  for (const auto& [angle, path] : folders) all.push_back(angle);
  if (DivideEvenly(all)) return all;
  const auto known =
      std::ranges::count_if(kFourAngles, [&](double angle) { return folders.contains(angle); });
  return known >= 2 ? kFourAngles : std::vector<double>();
}

std::vector<double> AnglesNamesMayMean(const fs::path& folder) {
  std::vector<double> angles;
  std::vector<std::string> names;
  for (const auto& [angle, path] : AngleFolders(folder)) {
    std::vector<std::string> now;
    for (const auto& [name, picture] : ListPictures(path)) now.push_back(name);
    if (now.empty() || (!names.empty() && now != names)) return {};
    names = now;
    angles.push_back(angle);
  }
  return angles.size() >= 3 ? angles : std::vector<double>();
}

std::vector<PictureFiles> SplitByAngle(const PictureFiles& files, const std::vector<double>& angles) {
  std::vector<PictureFiles> split(angles.size());
  for (const auto& [stem, path] : files) {
    const auto parts = SplitStem(stem);
    if (!parts) continue;
    const auto at = std::ranges::find(angles, parts->second);
    if (at == angles.end()) continue;
    const std::string name = parts->first.empty() ? "view" : parts->first;
    const auto [other, is_new] = split[std::size_t(at - angles.begin())].emplace(name, path);
    if (!is_new)
      throw Error(fmt::format("two pictures of one view have the angle {:g}", parts->second),
                  fmt::format("{} and {}", other->second.string(), path.string()), "Remove one of them");
  }
  return split;
}

bool AreNamedByFourAngles(const PictureFiles& files) {
  const auto has_angle = [](const auto& file) {
    const auto parts = SplitStem(file.first);
    return parts && !parts->first.empty();
  };
  if (files.empty() || !std::ranges::all_of(files, has_angle)) return false;
  const std::vector<PictureFiles> split = SplitByAngle(files, kFourAngles);
  const auto same_names = [&](const PictureFiles& other) {
    return std::ranges::equal(
        split[0], other, {}, [](const auto& f) { return f.first; }, [](const auto& f) { return f.first; });
  };
  return 4 * split[0].size() == files.size() && std::ranges::all_of(split, same_names);
}

}  // namespace polarscan
