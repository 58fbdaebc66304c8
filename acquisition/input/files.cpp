// SPDX-License-Identifier: Apache-2.0
#include "acquisition/input/files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <set>
#include <vector>

#include "acquisition/input/forms/angles.h"
#include "core/error.h"
#include "core/files/view_name.h"
#include "core/formats/image_io.h"
#include "core/words.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepestFolder = 8;

// Folders that hold other things than further pictures of the one that they lie in.
bool MeansSomethingElse(const fs::path& folder) {
  static const std::set<std::string> kNames = {
      "masks",  "mask", "truth", "sparse", "previews", "thumbnails", "thumbs", "mosaic", "photos", "images",
      "stokes", "rgb",  "aop",   "dop",    "s0",       "s1",         "s2",     "s3",     "s0p1",   "s0p2"};
  const std::string name = LowerCase(folder.filename().string());
  return name.starts_with('.') || name.starts_with("exposure-") || name.starts_with("exposure_") ||
         kNames.contains(name) ||
         std::ranges::any_of(std::array{"scan.json", "views.json", "session.json"},
                             [&](const char* file) { return fs::exists(folder / file); });
}

// been: the folders that were walked, as they lie on the disk: links may lead in circles.
void AddPictures(const fs::path& folder, const fs::path& top, int depth, std::set<fs::path>& been,
                 PictureFiles& files) {
  if (!been.insert(fs::canonical(folder)).second) return;
  const bool are_made_views = fs::exists(folder / "views.json");  // and pictures of them in folders
  std::set<fs::path> angles;
  for (const double angle : AnglesOfFolders(folder))
    if (const auto folders = AngleFolders(folder); folders.contains(angle)) angles.insert(folders.at(angle));
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const fs::path& path = entry.path();
    if (entry.is_directory() && depth < kDeepestFolder && !are_made_views && !angles.contains(path) &&
        !MeansSomethingElse(path))
      AddPictures(path, top, depth + 1, been, files);
    if (!entry.is_regular_file() || !IsPictureName(path) || path.filename().string().starts_with('.'))
      continue;
    if (!IsUtf8(path.filename().string()))
      throw Error("the name of a picture is not UTF-8, as an old disk's may be",
                  fmt::format("{} in {}", Excerpt(path.filename().string()), folder.string()),
                  "Rename it (convmv -f latin1 -t utf8 renames many)");
    const auto [at, is_new] = files.emplace(ViewName(path.lexically_relative(top)), path);
    if (!is_new)
      throw Error("two pictures have the same name",
                  fmt::format("{} and {}", at->second.string(), path.string()), "Remove one of them");
  }
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

PictureFiles ListPictureFiles(const fs::path& folder) {
  PictureFiles files;
  std::set<fs::path> been;
  AddPictures(folder, folder, 0, been, files);
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

std::map<std::string, fs::path> ListFolders(const fs::path& folder) {
  std::map<std::string, fs::path> folders;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_directory()) folders[LowerCase(entry.path().filename().string())] = entry.path();
  return folders;
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

StokesEnding StokesEndingOf(const std::string& stem) {
  static const std::vector<std::pair<std::string, StokesEnding>> kEndings = {{"s0", {0, false, 3}},
                                                                             {"s1", {1, false, 3}},
                                                                             {"s2", {2, false, 3}},
                                                                             {"s0p1", {1, true, 5}},
                                                                             {"s0p2", {2, true, 5}}};
  const std::string name = LowerCase(stem);
  for (const auto& [end, ending] : kEndings)
    if (name.size() > ending.length && name.ends_with(end) &&
        std::string("_-.").find(name[name.size() - ending.length]) != std::string::npos)
      return ending;
  return {};
}

bool IsUnusedComponent(const std::string& stem) {
  const std::string name = LowerCase(stem);
  return std::ranges::any_of(std::array{"_s3", "-s3", ".s3", "_s0p3", "-s0p3", ".s0p3"},
                             [&](const char* end) { return name.ends_with(end); });
}

bool HoldStokesComponents(const PictureFiles& files) {
  return std::ranges::any_of(files,
                             [](const auto& file) { return StokesEndingOf(file.first).component >= 0; });
}

}  // namespace polarscan
