// SPDX-License-Identifier: Apache-2.0
#include "acquisition/input/ignored_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "acquisition/input/files.h"
#include "core/error.h"
#include "core/formats/exr.h"
#include "core/formats/picture_header.h"
#include "core/words.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kNamesShown = 3;
constexpr int kDeepest = 8;

std::string EnumerateSorted(std::vector<std::string> names) {
  std::ranges::sort(names);
  return Enumerate(names, kNamesShown);
}

bool BelongsBeside(const fs::path& path) {
  static const std::set<std::string> kNotes = {"",     ".txt", ".md",  ".json", ".toml", ".yaml",
                                               ".yml", ".csv", ".log", ".html", ".pdf",  ".ini",
                                               ".xml", ".py",  ".sh",  ".db"};
  const std::string name = LowerCase(path.filename().string());
  return name.starts_with('.') || name.starts_with("readme") || name.starts_with("preview") ||
         name.starts_with("license") || kNotes.contains(LowerCase(path.extension().string()));
}

bool IsFolderBeside(const fs::path& folder) {
  static const std::set<std::string> kNames = {"masks",    "mask",       "sparse", "truth", "segments",
                                               "previews", "thumbnails", "s3",     "s0p3"};
  const std::string name = folder.filename().string();
  return name.starts_with('.') || kNames.contains(LowerCase(name)) || fs::exists(folder / "scan.json") ||
         fs::exists(folder / "views.json");
}

// been: as in files.cpp.
void Walk(const fs::path& folder, int depth, std::set<fs::path>& been, std::vector<fs::path>& files) {
  if (!been.insert(fs::canonical(folder)).second) return;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(folder, fs::directory_options::skip_permission_denied)) {
    if (entry.is_directory()) {
      if (depth < kDeepest && !IsFolderBeside(entry.path())) Walk(entry.path(), depth + 1, been, files);
    } else if (!BelongsBeside(entry.path())) {
      files.push_back(entry.path());
    }
  }
}

// What to do about files of this extension (lower case), which are not read.
std::string AdviceFor(const std::string& extension) {
  static const std::map<std::string, std::set<std::string>> kAdvice = {
      {"convert them to JPEG or PNG",
       {".heic", ".heif", ".avif", ".webp", ".jp2", ".jxl", ".gif", ".svg", ".psd"}},
      {"they have no header that says size and depth; save them as PGM or TIFF", {".raw", ".bin", ".dat"}},
      {"develop them to 16-bit TIFF without tone curve",
       {".cr2", ".cr3", ".nef", ".arw", ".dng", ".raf", ".orf", ".rw2", ".pef", ".srw"}},
      {"take pictures out of the video, as with ffmpeg", {".mp4", ".mov", ".avi", ".mkv", ".m4v", ".webm"}},
      {"save each array as .npy or float TIFF", {".npz", ".mat", ".h5", ".hdf5", ".pfm"}},
      {"unpack them", {".zip", ".tar", ".gz", ".7z", ".rar"}}};
  for (const auto& [advice, extensions] : kAdvice)
    if (extensions.contains(extension)) return advice;
  return "pictures are PNG, JPEG, TIFF, EXR, BMP, PGM, PPM, HDR or NPY";
}

struct UntakenKind {
  std::string where, extension;  // pictures: the folder that they lie in; others: the extension, or:
  bool is_broken_link = false;
  auto operator<=>(const UntakenKind&) const = default;
};

// alone: there is nothing else.
std::string Sentence(const UntakenKind& kind, const std::vector<std::string>& names, bool alone) {
  const char* are = names.size() == 1 ? "is" : "are";
  if (kind.is_broken_link)
    return fmt::format("{} {} to a file that is not there ({})", CountOf(names.size(), "link"),
                       names.size() == 1 ? "leads" : "lead", EnumerateSorted(names));
  if (!kind.extension.empty())
    return fmt::format("{} {} file{} not read ({}): {}", names.size(), kind.extension,
                       names.size() == 1 ? " is" : "s are", EnumerateSorted(names),
                       AdviceFor(LowerCase(kind.extension)));
  const std::string what = fmt::format("{} picture{} in {} {} not used ({})", names.size(),
                                       names.size() == 1 ? "" : "s", kind.where, are, EnumerateSorted(names));
  return what +
         (alone
              ? ": give the folder that they make a set in by itself, or say with --input-kind what they are"
              : ": they do not belong to the set that is read. Move them, or say with --input-kind what to "
                "read");
}

// Numbers of pictures by what they have, "16 bits", with the names of those that have it.
using Groups = std::map<std::string, std::vector<std::string>>;

// "7 pictures have 16 bits, 1 has 8 bits (b.png)": the most frequent first, whose names nobody needs.
std::string Unlike(const Groups& groups) {
  std::vector<std::pair<std::string, std::vector<std::string>>> sorted(groups.begin(), groups.end());
  std::ranges::stable_sort(sorted, std::greater(), [](const auto& group) { return group.second.size(); });
  std::string text;
  for (const auto& [what, names] : sorted) {
    const char* have = names.size() == 1 ? "has" : "have";
    text += text.empty() ? fmt::format("{} of them {} {}", names.size(), have, what)
                         : fmt::format(", {} {} {} ({})", names.size(), have, what, EnumerateSorted(names));
  }
  return text;
}

// Where one size is another turned by 90 degrees.
bool HoldTurned(const Groups& sizes, const std::map<std::string, PictureHeader>& of) {
  for (const auto& [a, names] : sizes)
    for (const auto& [b, others] : sizes)
      if (of.at(a).width == of.at(b).height && of.at(a).height == of.at(b).width && a != b) return true;
  return false;
}

// Of the pictures that stand at place `k` of their views.
void AddDifferences(const Input& input, std::size_t k, std::vector<std::string>& odd) {
  Groups depths, sizes, channels;
  std::map<std::string, PictureHeader> of_size;
  for (const InputView& view : input.views) {
    const PictureHeader header = ReadPictureHeader(view.files[k]);
    if (header.width == 0) continue;  // of a kind without such a header, or damaged: reading will tell
    const std::string name = view.files[k].lexically_relative(input.folder).string();
    const std::string size = fmt::format("{}x{} pixels", header.width, header.height);
    depths[fmt::format("{} bits", header.bits)].push_back(name);
    sizes[size].push_back(name);
    of_size[size] = header;
    if (header.channels > 0) channels[header.channels >= 3 ? "colours" : "grey values"].push_back(name);
  }
  const std::string advice = "Save them alike, or reconstruct them apart";
  if (depths.size() > 1)
    throw Error("pictures of one set differ in depth: " + Unlike(depths), input.folder.string(), advice);
  const bool mosaics = input.kind == InputKind::kMosaic;
  if (mosaics && HoldTurned(sizes, of_size))
    throw Error(
        "some of these mosaics were turned, so that the layout does not hold for all: " + Unlike(sizes),
        input.folder.string(), "Give them as the camera took them");
  if (sizes.size() > 1)
    odd.push_back(
        fmt::format("the pictures differ in size: {}{}", Unlike(sizes),
                    mosaics ? ". If a part of the sensor was read, the layout must hold there too" : ""));
  if (channels.size() > 1 && !mosaics) odd.push_back("the pictures differ in colour: " + Unlike(channels));
}

// Channels of EXR files beside grey or colours and opacity, where the files are not Stokes pictures.
void AddUnusedChannels(const Input& input, std::vector<std::string>& odd) {
  static const std::set<std::string> kUsed = {"R", "G", "B", "A", "Y", "RY", "BY"};
  std::set<std::string> unused;
  for (const InputView& view : input.views)
    for (const fs::path& file : view.files) {
      if (LowerCase(file.extension().string()) != ".exr") continue;
      const std::vector<std::string> channels = ExrChannels(file);
      if (channels.size() > 1) unused.insert(channels.begin(), channels.end());
    }
  std::erase_if(unused, [](const std::string& name) { return kUsed.contains(name); });
  if (!unused.empty())
    odd.push_back(
        fmt::format("the EXR files have channels that are not used: {}. If they are Stokes pictures, give "
                    "--input-kind stokes",
                    EnumerateSorted({unused.begin(), unused.end()})));
}

}  // namespace

std::vector<std::string> Untaken(const fs::path& folder, const std::vector<InputView>& taken) {
  std::set<fs::path> used;
  for (const InputView& view : taken) {
    used.insert(view.files.begin(), view.files.end());
    if (view.mask) used.insert(*view.mask);
  }
  std::vector<fs::path> files;
  std::set<fs::path> been;
  Walk(folder, 0, been, files);
  std::map<UntakenKind, std::vector<std::string>> kinds;
  for (const fs::path& file : files) {
    if (used.contains(file)) continue;
    const fs::path below = file.lexically_relative(folder);
    if (IsPictureName(file) && IsUnusedComponent(file.stem().string())) continue;
    const std::string parent = below.parent_path().string();
    const UntakenKind kind = !fs::exists(file) ? UntakenKind{"", "", true}
                             : IsPictureName(file)
                                 ? UntakenKind{parent.empty() ? "the folder itself" : parent + "/", ""}
                                 : UntakenKind{"", file.extension().string()};
    kinds[kind].push_back(!kind.where.empty() ? below.filename().string() : below.string());
  }
  std::vector<std::string> sentences;
  for (const auto& [kind, names] : kinds) sentences.push_back(Sentence(kind, names, taken.empty()));
  return sentences;
}

std::string WhatLiesThere(const fs::path& folder) {
  const std::vector<std::string> sentences = Untaken(folder, {});
  return sentences.empty() ? "" : fmt::format("What lies there: {}", fmt::join(sentences, "; "));
}

std::vector<std::string> Differences(const Input& input) {
  std::vector<std::string> odd;
  for (std::size_t k = 0; k < input.views[0].files.size(); ++k) AddDifferences(input, k, odd);
  if (input.kind != InputKind::kStokes) AddUnusedChannels(input, odd);
  return odd;
}

}  // namespace polarscan
