// SPDX-License-Identifier: Apache-2.0
#include "acquisition/input_files.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <charconv>

#include "core/error.h"
#include "core/image_io.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// The polarizer angle that a folder's (lower case) name stands for, "i-045", "i45" or "45"; -1 if none.
int AngleOf(std::string name) {
  if (name.starts_with('i')) name.erase(0, name.size() > 1 && (name[1] == '-' || name[1] == '_') ? 2 : 1);
  if (name.empty() || name.size() > 3 ||
      !std::ranges::all_of(name, [](char c) { return c >= '0' && c <= '9'; }))
    return -1;
  const int angle = std::stoi(name);
  return angle == 0 || angle == 45 || angle == 90 || angle == 135 ? angle : -1;
}

// The stem without ".mask", "_mask" or "-mask" at its end (any case); empty if it has none.
std::string WithoutMaskEnding(const std::string& stem) {
  const std::string lower = LowerCase(stem);
  for (const char* ending : {".mask", "_mask", "-mask"})
    if (lower.ends_with(ending)) return stem.substr(0, stem.size() - 5);
  return "";
}

// "a.png" to "a".
std::string WithoutPictureEnding(const std::string& name) {
  return IsPictureName(name) ? fs::path(name).stem().string() : name;
}

}  // namespace

std::string LowerCase(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

PictureFiles ListPictureFiles(const fs::path& folder) {
  PictureFiles files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const fs::path& path = entry.path();
    if (!entry.is_regular_file() || !IsPictureName(path) || path.filename().string().starts_with('.'))
      continue;
    const auto [at, is_new] = files.emplace(path.stem().string(), path);
    if (!is_new)
      throw Error("two pictures have the same name",
                  fmt::format("{} and {}", at->second.string(), path.string()), "Remove one of them");
  }
  return files;
}

PictureFiles ListPictures(const fs::path& folder) {
  PictureFiles files = ListPictureFiles(folder);
  for (const auto& [stem, path] : MasksAmong(files)) files.erase(stem);
  return files;
}

PictureFiles MasksAmong(const PictureFiles& files) {
  PictureFiles masks;
  for (const auto& [stem, path] : files)
    if (const std::string name = WithoutMaskEnding(stem);
        files.contains(name) || files.contains(WithoutPictureEnding(name)))
      masks.emplace(stem, path);
  return masks;
}

std::vector<std::string> NamesBehindMask(const std::string& stem) {
  std::vector<std::string> names = {stem, WithoutPictureEnding(stem)};
  if (const std::string name = WithoutMaskEnding(stem); !name.empty())
    names.insert(names.end(), {name, WithoutPictureEnding(name)});
  return names;
}

std::string FirstOf(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 5;
  const std::size_t shown = std::min(names.size(), kShown);
  const std::string more = shown < names.size() ? fmt::format(" and {} more", names.size() - shown) : "";
  return fmt::format("{}{}", fmt::join(names.begin(), names.begin() + std::ptrdiff_t(shown), ", "), more);
}

std::map<std::string, fs::path> ListFolders(const fs::path& folder) {
  std::map<std::string, fs::path> folders;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_directory()) folders[LowerCase(entry.path().filename().string())] = entry.path();
  return folders;
}

std::map<int, fs::path> AngleFolders(const fs::path& folder) {
  std::map<int, fs::path> angles;
  for (const auto& [name, path] : ListFolders(folder)) {
    const int angle = AngleOf(name);
    if (angle >= 0 && !angles.emplace(angle, path).second)
      throw Error(fmt::format("two folders hold the angle {}", angle), folder.string(), "Remove one of them");
  }
  return angles;
}

std::map<double, fs::path> ExposureFolders(const fs::path& folder) {
  std::map<double, fs::path> exposures;
  for (const auto& [name, path] : ListFolders(folder)) {
    if (!name.starts_with("exposure-") && !name.starts_with("exposure_")) continue;
    double time = 0;
    const char* end = name.data() + name.size();
    const auto [at, error] = std::from_chars(name.data() + 9, end, time);
    if (error != std::errc() || at != end || !(time > 0))
      throw Error("the folder's name has no exposure time", path.string(), "Name it like exposure-500");
    if (!exposures.emplace(time, path).second)
      throw Error(fmt::format("two folders hold the exposure {:g}", time), folder.string(),
                  "Remove one of them");
  }
  return exposures;
}

int StokesComponent(const std::string& stem) {
  const std::string end = LowerCase(stem.size() > 3 ? stem.substr(stem.size() - 3) : "");
  const bool fits = end.size() == 3 && std::string("_-.").find(end[0]) != std::string::npos && end[1] == 's';
  return fits && end[2] >= '0' && end[2] <= '2' ? end[2] - '0' : -1;
}

bool HoldStokesComponents(const PictureFiles& files) {
  return std::ranges::any_of(files, [](const auto& file) { return StokesComponent(file.first) >= 0; });
}

}  // namespace polarscan
