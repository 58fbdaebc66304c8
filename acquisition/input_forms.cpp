// SPDX-License-Identifier: Apache-2.0
#include "acquisition/input_forms.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "acquisition/input_files.h"
#include "core/error.h"
#include "core/files.h"

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

std::vector<InputView> ListAngles(const fs::path& folder) {
  const std::map<int, fs::path> angles = AngleFolders(folder);
  std::vector<fs::path> folders;
  for (const int angle : {0, 45, 90, 135}) {
    if (!angles.contains(angle))
      throw Error(fmt::format("the folder of the angle {} is missing", angle), folder.string(),
                  "Four are needed, named I-00 I-45 I-90 I-135 or 0 45 90 135");
    folders.push_back(angles.at(angle));
  }
  return JoinFolders(folders, folder);
}

std::vector<InputView> ListFlat(const PictureFiles& files) {
  std::vector<InputView> views;
  for (const auto& [name, path] : files) views.push_back({name, {path}, {}});
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
  if (folders.contains("s0")) {
    std::vector<fs::path> components = {folder / "s0", folder / "s1", folder / "s2"};
    for (fs::path& component : components) {
      const std::string name = component.filename().string();
      if (!folders.contains(name))
        throw Error(fmt::format("the folder {} is missing", name), folder.string());
      component = folders.at(name);
    }
    return JoinFolders(components, folder);
  }
  const PictureFiles files = ListPictures(folder);
  if (!HoldStokesComponents(files)) return ListFlat(files);
  std::vector<Named> lists = {{"*_s0", {}}, {"*_s1", {}}, {"*_s2", {}}};
  for (const auto& [stem, path] : files)
    if (const int component = StokesComponent(stem); component >= 0)
      lists[std::size_t(component)].files[stem.substr(0, stem.size() - 3)] = path;
  return Join(lists, folder);
}

std::vector<InputView> ListIn(const fs::path& folder, const std::vector<std::string>& subfolders) {
  for (const std::string& name : subfolders)
    if (fs::is_directory(folder / name)) return ListFlat(ListPictures(folder / name));
  return ListFlat(ListPictures(folder));
}

std::vector<InputView> ListMosaics(const fs::path& folder) {
  const std::map<double, fs::path> exposures = ExposureFolders(folder);
  if (exposures.empty()) return ListIn(folder, {"mosaic"});
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

std::vector<InputView> ListViews(const fs::path& folder, InputKind kind) {
  std::vector<InputView> views;
  if (IsViewFolder(folder) && (kind == InputKind::kStokes || kind == InputKind::kPhotos))
    return ListMadeViews(folder, kind);
  if (kind == InputKind::kMosaic) views = ListMosaics(folder);
  if (kind == InputKind::kAngles) views = ListAngles(folder);
  if (kind == InputKind::kStokes) views = ListStokes(folder);
  if (kind == InputKind::kPhotos) views = ListIn(folder, {"photos", "images"});
  if (kind == InputKind::kRgbAopDop) {
    for (const char* name : {"rgb", "aop", "dop"})
      if (!fs::is_directory(folder / name))
        throw Error(fmt::format("the folder {}/ is missing", name), folder.string());
    views = JoinFolders({folder / "rgb", folder / "aop", folder / "dop"}, folder);
  }
  if (views.empty())
    throw Error(fmt::format("there are no {} pictures here", ToString(kind)), folder.string());
  return views;
}

}  // namespace polarscan
