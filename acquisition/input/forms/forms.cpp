// SPDX-License-Identifier: Apache-2.0
#include "acquisition/input/forms/forms.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "acquisition/input/files.h"
#include "acquisition/input/forms/angles.h"
#include "acquisition/input/ignored_files.h"
#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/tiff_pages.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

struct Named {
  std::string label;
  PictureFiles files;
};

// Views whose files lie in several lists under the same name; a name missing in one is an error.
std::vector<InputView> Join(const std::vector<Named>& lists, const fs::path& folder) {
  std::map<std::string, InputView> views;
  for (const Named& list : lists)
    for (const auto& [name, path] : list.files) {
      views[name].name = name;
      views[name].files.push_back(path);
    }
  std::vector<InputView> complete;
  std::string missing;
  for (const Named& list : lists) {
    std::vector<std::string> names;
    for (const auto& [name, view] : views)
      if (!list.files.contains(name)) names.push_back(name);
    if (names.empty()) continue;
    const std::size_t more = names.size() > 8 ? names.size() - 8 : 0;
    names.resize(names.size() - more);
    missing += fmt::format("; {} lacks {}{}", list.label, fmt::join(names, ", "),
                           more ? fmt::format(" and {} more", more) : "");
  }
  if (!missing.empty())
    throw Error("pictures that belong together are not complete" + missing, folder.string(),
                "Every view needs a picture of the same name in each of them");
  for (auto& [name, view] : views) complete.push_back(std::move(view));
  return complete;
}

std::vector<InputView> JoinFolders(const std::vector<fs::path>& folders, const fs::path& parent) {
  std::vector<Named> lists;
  for (const fs::path& folder : folders)
    lists.push_back({folder.filename().string() + "/", ListPictures(folder)});
  return Join(lists, parent);
}

constexpr const char* kAngleForms =
    "Polarizer pictures are folders I-00 I-45 I-90 I-135 (also 0 60 120), files NAME_0 NAME_60 NAME_120 or "
    "TIFF with a page or channel an angle; --angles 0,60,120 says which";

// Whether the file is a TIFF of so many pages, or of so many channels that are no colours.
bool IsStackOf(std::size_t count, const fs::path& path) {
  if (!IsTiff(path)) return false;
  const std::vector<TiffPage> pages = TiffPages(path);
  return pages.size() == count ||
         (pages.size() == 1 && std::size_t(pages[0].samples) == count && !pages[0].rgb);
}

// One file a view, with as many pages or channels as there are angles.
std::vector<InputView> ListAngleStacks(const PictureFiles& files, const std::vector<double>& angles,
                                       bool given, Input& input) {
  input.angles = angles;
  std::vector<InputView> views;
  for (const auto& [name, path] : files) {
    const std::vector<TiffPage> pages = IsTiff(path) ? TiffPages(path) : std::vector<TiffPage>(1);
    const std::size_t channels = std::size_t(pages[0].samples),
                      count = pages.size() > 1 ? pages.size() : channels;
    if (count != input.angles.size())
      throw Error(fmt::format("this file has {} page{} of {} channel{}, and the polarizer has {} angles ({})",
                              pages.size(), pages.size() == 1 ? "" : "s", channels, channels == 1 ? "" : "s",
                              input.angles.size(), AnglesText(input.angles)),
                  path.string(), kAngleForms);
    if (pages.size() == 1 && pages[0].rgb && !given)
      throw Error(
          "the channels of this TIFF are marked as red, green, blue and another", path.string(),
          "If they are polarizer angles all the same, say which in this order, as in --angles 0,45,90,135 "
          "(files written by OpenCV: the third angle comes first, 90,45,0,135)");
    views.push_back({name, {path}, {}});
  }
  if (!views.empty() && !given)
    input.notes.push_back(
        fmt::format("pages or channels are taken as the polarizer angles {}, in this order (--angles if "
                    "they are others)",
                    AnglesText(input.angles)));
  return views;
}

// For an example of --angles: those of the folders, where they are enough.
std::vector<double> OwnAngles(const std::map<double, fs::path>& folders) {
  std::vector<double> angles;
  for (const auto& [angle, folder] : folders) angles.push_back(angle);
  return angles.size() >= 3 ? angles : std::vector<double>{0, 60, 120};
}

std::vector<InputView> ListAngles(const std::string& given, Input& input) {
  const std::map<double, fs::path> folders = AngleFolders(input.folder);
  const std::vector<double> found = AnglesOfFolders(input.folder);
  const std::vector<double> in_given_order = given.empty() ? input.angles : ParseAngles(given);
  if (!given.empty() || !found.empty()) input.angles = given.empty() ? found : in_given_order;
  std::ranges::sort(input.angles);  // so that the usual four are known as such
  const auto has_folder = [&](double angle) { return folders.contains(angle); };
  if (std::ranges::any_of(input.angles, has_folder)) {
    std::vector<fs::path> in_order;
    for (const double angle : input.angles) {
      if (!has_folder(angle))
        throw Error(
            fmt::format("the folder of the angle {:g} is missing", angle), input.folder.string(),
            "Four are needed, named I-00 I-45 I-90 I-135 or 0 45 90 135; others with --angles, as in " +
                AnglesOption(OwnAngles(folders)));
      in_order.push_back(folders.at(angle));
    }
    if (given.empty() && input.angles != Input().angles)
      input.notes.push_back(
          fmt::format("the folders' names are taken as polarizer angles: {}", AnglesText(input.angles)));
    return JoinFolders(in_order, input.folder);
  }
  PictureFiles files = ListPictures(input.folder);
  for (const char* name : {"mosaic", "images", "photos"})
    if (files.empty() && fs::is_directory(input.folder / name)) files = ListPictures(input.folder / name);
  const std::vector<PictureFiles> split = SplitByAngle(files, input.angles);
  const bool are_named = std::ranges::any_of(split, [](const PictureFiles& of) { return !of.empty(); });
  if (!are_named || IsStackOf(input.angles.size(), files.begin()->second))
    return ListAngleStacks(files, in_given_order, !given.empty(), input);
  std::vector<Named> lists;
  for (std::size_t i = 0; i < split.size(); ++i)
    lists.push_back({fmt::format("*_{:g}", input.angles[i]), split[i]});
  if (given.empty())
    input.notes.push_back(fmt::format("the numbers at the end of the names are taken as polarizer angles: {}",
                                      AnglesText(input.angles)));
  return Join(lists, input.folder);
}

// A file that holds one picture where that can be told; a view for each page of a TIFF that has several.
void AddFlat(const std::string& name, const fs::path& path, Input& input, std::vector<InputView>& views) {
  std::vector<TiffPage> pages(1);
  try {
    if (IsTiff(path)) pages = TiffPages(path);
  } catch (const Error&) {  // damaged: reading tells
  }
  for (const TiffPage& page : pages)
    if (page.samples > 4 || (page.samples == 4 && !page.rgb) || (page.samples == 2 && !page.has_alpha))
      throw Error(fmt::format("this TIFF has {} channels that are not said to be colours", page.samples),
                  path.string(),
                  "If they are the polarizer angles 0 45 90 135, give --input-kind angles (other ones or "
                  "another order: --angles too)");
  if (pages.size() == 1) return views.push_back({name, {path}, {}});
  for (std::size_t i = 0; i < pages.size(); ++i) {
    if (pages[i].width != pages[0].width || pages[i].height != pages[0].height ||
        pages[i].bits != pages[0].bits)
      throw Error(fmt::format("page {} of this TIFF is of another size or depth than the first one", i),
                  path.string(), "Save the pictures in files of their own");
    InputView view{fmt::format("{}-{:03}", name, i), {path}, {}};
    view.page = pages[i].directory;
    views.push_back(view);
  }
  input.notes.push_back(fmt::format("{} has {} pages, each of which is taken as a {} of its own",
                                    path.filename().string(), pages.size(),
                                    input.kind == InputKind::kMosaic ? "mosaic" : "photo"));
}

std::vector<InputView> ListFlat(const PictureFiles& files, Input& input) {
  std::vector<InputView> views;
  for (const auto& [name, path] : files) AddFlat(name, path, input, views);
  std::ranges::sort(views, {}, &InputView::name);
  const auto twice = std::ranges::adjacent_find(views, {}, &InputView::name);
  if (twice != views.end())
    throw Error(fmt::format("a page of a TIFF and a picture have the same name, {}", twice->name),
                fmt::format("{} and {}", twice->files[0].string(), std::next(twice)->files[0].string()),
                "Rename one of them");
  return views;
}

// What views.json lists: as Stokes, or, where there was no polarization, as the pictures beside them.
std::vector<InputView> ListMadeViews(const fs::path& folder, InputKind kind) {
  std::vector<InputView> views;
  const nlohmann::json state = ReadJson(folder / "views.json");
  for (const auto& [name, record] : state.at("views").items()) {
    const fs::path file = folder / (name + (kind == InputKind::kPhotos ? ".png" : ".tif"));
    if (!fs::exists(file))
      throw Error("views.json lists a view that is not there", file.string(),
                  "Run the same polarscan demosaic again");
    views.push_back({name, {file}, {}});
  }
  return views;
}

std::vector<InputView> ListStokes(const fs::path& parent) {
  const fs::path folder = fs::is_directory(parent / "stokes") ? parent / "stokes" : parent;
  const auto folders = ListFolders(folder);
  std::vector<InputView> views;
  bool sums = false;
  if (folders.contains("s0")) {
    sums = !folders.contains("s1") && folders.contains("s0p1");
    std::vector<fs::path> components;
    for (const std::string name : {"s0", sums ? "s0p1" : "s1", sums ? "s0p2" : "s2"}) {
      if (!folders.contains(name))
        throw Error(fmt::format("the folder {} is missing", name), folder.string());
      components.push_back(folders.at(name));
    }
    views = JoinFolders(components, folder);
  } else {
    const PictureFiles files = ListPictures(folder);
    if (!HoldStokesComponents(files)) {
      for (const auto& [name, path] : files) views.push_back({name, {path}, {}});
      return views;
    }
    const auto is_s1 = [](const auto& file) {
      const StokesEnding ending = StokesEndingOf(file.first);
      return ending.component > 0 && !ending.is_sum;
    };
    const auto is_sum = [](const auto& file) { return StokesEndingOf(file.first).is_sum; };
    sums = std::ranges::none_of(files, is_s1) && std::ranges::any_of(files, is_sum);
    std::vector<Named> lists = {{"*_s0", {}}, {sums ? "*_s0p1" : "*_s1", {}}, {sums ? "*_s0p2" : "*_s2", {}}};
    for (const auto& [stem, path] : files)
      if (const StokesEnding ending = StokesEndingOf(stem);
          ending.component == 0 || (ending.component > 0 && ending.is_sum == sums))
        lists[std::size_t(ending.component)].files[stem.substr(0, stem.size() - ending.length)] = path;
    views = Join(lists, folder);
  }
  for (InputView& view : views) view.sums = sums;
  return views;
}

std::vector<InputView> ListIn(const std::vector<std::string>& subfolders, Input& input) {
  for (const std::string& name : subfolders)
    if (fs::is_directory(input.folder / name)) return ListFlat(ListPictures(input.folder / name), input);
  return ListFlat(ListPictures(input.folder), input);
}

std::vector<InputView> ListMosaics(Input& input) {
  const fs::path& folder = input.folder;
  const std::map<double, fs::path> exposures = ExposureFolders(folder);
  if (exposures.empty()) return ListIn({"mosaic"}, input);
  std::vector<fs::path> folders;
  std::vector<double> times;
  for (const auto& [time, path] : exposures) folders.push_back(path), times.push_back(time);
  std::vector<InputView> views = JoinFolders(folders, folder);
  if (times.size() > 1)
    for (InputView& view : views) view.exposures = times;
  return views;
}

}  // namespace

bool IsViewFolder(const fs::path& folder) {
  if (!fs::exists(folder / "views.json")) return false;
  try {
    const nlohmann::json state = ReadJson(folder / "views.json");
    return state.is_object() && state.contains("polarized") && state.contains("views") &&
           state["views"].is_object();
  } catch (const Error&) {
    return false;
  }
}

void FindViews(const std::string& angles, Input& input) {
  const fs::path& folder = input.folder;
  std::vector<InputView>& views = input.views;
  if (IsViewFolder(folder) && (input.kind == InputKind::kStokes || input.kind == InputKind::kPhotos)) {
    views = ListMadeViews(folder, input.kind);
    return;
  }
  if (input.kind == InputKind::kMosaic) views = ListMosaics(input);
  if (input.kind == InputKind::kAngles) views = ListAngles(angles, input);
  if (input.kind == InputKind::kStokes) views = ListStokes(folder);
  if (input.kind == InputKind::kPhotos) views = ListIn({"photos", "images"}, input);
  if (input.kind == InputKind::kRgbAopDop) {
    for (const char* name : {"rgb", "aop", "dop"})
      if (!fs::is_directory(folder / name))
        throw Error(fmt::format("the folder {}/ is missing", name), folder.string());
    views = JoinFolders({folder / "rgb", folder / "aop", folder / "dop"}, folder);
  }
  if (views.empty())
    throw Error(fmt::format("there are no {} pictures here", ToString(input.kind)), folder.string(),
                WhatLiesThere(folder));
}

}  // namespace polarscan
