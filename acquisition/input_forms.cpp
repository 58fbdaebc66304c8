// SPDX-License-Identifier: Apache-2.0
#include "acquisition/input_forms.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "core/error.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

using Files = std::map<std::string, fs::path>;  // by view name, hence sorted
struct Named {
  std::string label;
  Files files;
};

std::string Lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

// The pictures of a folder by stem. Hidden files are not looked at.
Files ListPictures(const fs::path& folder) {
  Files files;
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

std::map<std::string, fs::path> ListFolders(const fs::path& folder) {
  std::map<std::string, fs::path> folders;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_directory()) folders[Lower(entry.path().filename().string())] = entry.path();
  return folders;
}

// The polarizer angle that a folder's (lower case) name stands for, "i-045", "i45" or "45"; -1 if none.
int AngleOf(std::string name) {
  if (name.starts_with('i')) name.erase(0, name.size() > 1 && (name[1] == '-' || name[1] == '_') ? 2 : 1);
  if (name.empty() || name.size() > 3 ||
      !std::ranges::all_of(name, [](char c) { return c >= '0' && c <= '9'; }))
    return -1;
  const int angle = std::stoi(name);
  return angle == 0 || angle == 45 || angle == 90 || angle == 135 ? angle : -1;
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

// 0, 1, 2 if the stem ends in _s0, _s1, _s2 (or -s0, .s0; any case); -1 otherwise.
int StokesComponent(const std::string& stem) {
  const std::string end = Lower(stem.size() > 3 ? stem.substr(stem.size() - 3) : "");
  const bool fits = end.size() == 3 && std::string("_-.").find(end[0]) != std::string::npos && end[1] == 's';
  return fits && end[2] >= '0' && end[2] <= '2' ? end[2] - '0' : -1;
}

bool HoldsStokesNames(const Files& files) {
  return std::ranges::any_of(files, [](const auto& file) { return StokesComponent(file.first) >= 0; });
}

std::vector<InputView> ListFlat(const Files& files) {
  std::vector<InputView> views;
  for (const auto& [name, path] : files) views.push_back({name, {path}, {}});
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
  const Files files = ListPictures(folder);
  if (!HoldsStokesNames(files)) return ListFlat(files);
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

bool IsStokesFile(const fs::path& path, const Picture& picture) {
  return picture.bits == 32 && Lower(path.extension().string()).starts_with(".tif") &&
         ReadFloatTiff(path).size() >= 3;
}

bool IsGrey(const Picture& picture) {
  for (const Image<float>& plane : picture.planes)
    if (!std::ranges::equal(plane.pixels(), picture.planes[0].pixels())) return false;
  return true;
}

// Pictures that lie flat in the folder: what they are shows in their names or in the first one.
InputKind RecognizeFlat(const fs::path& folder, const InputOptions& options) {
  const Files files = ListPictures(folder);
  if (files.empty())
    throw Error("there are no pictures here", folder.string(),
                "Give a folder with pictures (PNG, JPEG, TIFF or EXR), or one with mosaic/, I-00/ I-45/ "
                "I-90/ I-135/, "
                "stokes/ or rgb/ aop/ dop/");
  if (HoldsStokesNames(files)) return InputKind::kStokes;
  const auto& [name, path] = *files.begin();
  const Picture first = ReadPicture(path);
  if (IsStokesFile(path, first)) return InputKind::kStokes;
  if (!IsGrey(first)) return InputKind::kPhotos;
  if (!options.layout.empty()) return InputKind::kMosaic;
  throw Error("these grey pictures may be raw mosaics or plain photos", folder.string(),
              "Give --input-kind mosaic --layout \"90 45 / 135 0\" (with your sensor's angles) or "
              "--input-kind photos");
}

InputKind KindOf(const std::string& name) {
  for (const InputKind kind : {InputKind::kMosaic, InputKind::kAngles, InputKind::kStokes,
                               InputKind::kRgbAopDop, InputKind::kPhotos})
    if (ToString(kind) == name) return kind;
  throw Error("there is no such kind of input", name);
}

}  // namespace

InputKind RecognizeKind(const fs::path& folder, const InputOptions& options) {
  if (options.kind != "auto") return KindOf(options.kind);
  const auto folders = ListFolders(folder);
  std::vector<InputKind> kinds;
  if (folders.contains("mosaic")) kinds.push_back(InputKind::kMosaic);
  if (AngleFolders(folder).size() >= 2) kinds.push_back(InputKind::kAngles);
  if (folders.contains("stokes") || (folders.contains("s0") && folders.contains("s1")))
    kinds.push_back(InputKind::kStokes);
  if (folders.contains("aop") && folders.contains("dop")) kinds.push_back(InputKind::kRgbAopDop);
  if (folders.contains("photos") || folders.contains("images")) kinds.push_back(InputKind::kPhotos);
  if (kinds.empty()) return RecognizeFlat(folder, options);
  if (kinds.size() == 1) return kinds[0];
  throw Error(fmt::format("the folder holds pictures of several kinds ({} and {})", ToString(kinds[0]),
                          ToString(kinds[1])),
              folder.string(), fmt::format("Say which to use, as in --input-kind {}", ToString(kinds[0])));
}

std::vector<InputView> ListViews(const fs::path& folder, InputKind kind) {
  std::vector<InputView> views;
  if (kind == InputKind::kMosaic) views = ListIn(folder, {"mosaic"});
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

void FindMasks(const fs::path& folder, std::vector<InputView>& views) {
  if (!fs::is_directory(folder / "masks")) return;
  const Files masks = ListPictures(folder / "masks");
  std::size_t found = 0;
  for (InputView& view : views)
    if (const auto mask = masks.find(view.name); mask != masks.end()) {
      view.mask = mask->second;
      ++found;
    }
  if (found == 0 && !masks.empty())
    throw Error("no mask has the name of a view", (folder / "masks").string(),
                fmt::format("Masks are named like the views: {}.png, not {}", views[0].name,
                            masks.begin()->second.filename().string()));
}

}  // namespace polarscan
