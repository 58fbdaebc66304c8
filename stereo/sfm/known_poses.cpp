// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/known_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>

#include "core/error.h"
#include "core/files/view_name.h"
#include "core/words.h"
#include "stereo/sfm/check_poses.h"
#include "stereo/sfm/model/camera_models.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// What a view may be called whose picture has this name: "left/001.png" is "left-001", "left-001.png", "001"
// or "001.png". Folders of other systems count too.
std::vector<std::string> NamesOf(std::string name) {
  std::ranges::replace(name, '\\', '/');
  std::vector<std::string> names;
  for (fs::path rest = name; !rest.empty();) {
    names.push_back(ViewName(rest));
    names.push_back(names.back() + rest.extension().string());
    rest = rest.has_parent_path() ? rest.lexically_relative(*rest.begin()) : fs::path();
  }
  return names;
}

// Images by all that they may be called, each at the first place of NamesOf where a view looks for it.
using ImagesByName = std::vector<std::multimap<std::string, const ColmapImage*>>;

ImagesByName IndexByName(const SparseModel& given) {
  ImagesByName index;
  for (const auto& [id, image] : given.images) {
    const std::vector<std::string> names = NamesOf(image.name);
    index.resize(std::max(index.size(), names.size()));
    for (std::size_t k = 0; k < names.size(); ++k) index[k].emplace(names[k], &image);
  }
  return index;
}

// The view's image, or nullptr.
const ColmapImage* FindImage(const ImagesByName& index, const std::string& view, const std::string& where) {
  for (const auto& images : index) {
    const auto [begin, end] = images.equal_range(view);
    if (begin == end) continue;
    if (std::next(begin) != end)
      throw Error(fmt::format("the images {} and {} of the model are both named as the view {}",
                              begin->second->name, std::next(begin)->second->name, view),
                  where, "Rename them, so that each name tells which view it is");
    return begin->second;
  }
  return nullptr;
}

void RequireTwo(const SparseModel& kept, const SparseModel& given, const std::vector<ListedView>& views,
                const std::string& where) {
  if (kept.images.size() > 1) return;
  if (views.size() == 1)
    throw Error(fmt::format("there is one picture only, {}: depth needs two at least", views[0].name), where,
                "Add pictures from other places, about 20 degrees apart");
  std::vector<std::string> theirs, ours;
  for (const auto& [id, image] : given.images) theirs.push_back(image.name);
  for (const ListedView& view : views) ours.push_back(view.name);
  const std::string names =
      fmt::format("the model has {}; the views are {}", theirs.empty() ? "no images" : Enumerate(theirs, 3),
                  Enumerate(ours, 3));
  const char* advice =
      "Names must be equal but for folder and extension; correct those in the model, or take it away, so "
      "that the poses come from the pictures";
  if (kept.images.empty()) throw Error("no image of the model belongs to a view: " + names, where, advice);
  throw Error(
      fmt::format("only 1 of {} views has a known pose, at least 2 are needed: {}", views.size(), names),
      where, advice);
}

// The image with its observations at the scale of the view's picture.
ColmapImage AdaptImage(ColmapImage image, const ColmapCamera& camera, const ListedView& view) {
  const bool sized = view.width > 0;
  const double sx = sized ? double(view.width) / camera.width : 1,
               sy = sized ? double(view.height) / camera.height : 1;
  for (ColmapImage::Observation& observation : image.observations) {
    observation.x *= sx;
    observation.y *= sy;
  }
  image.name = view.PictureName();
  return image;
}

// The camera's number among `cameras`: its own, or a new one above `last` where another picture of that
// camera has another size. Throws Error if its lens model is not supported.
std::uint32_t AddCamera(ColmapCamera camera, std::uint32_t last,
                        std::map<std::uint32_t, ColmapCamera>& cameras) {
  ToLens(camera);
  const auto is_same = [&](const ColmapCamera& other) {
    return other.width == camera.width && other.height == camera.height;
  };
  while (cameras.contains(camera.id) && !is_same(cameras[camera.id]))
    camera.id = std::max(last, camera.id) + 1;
  const std::uint32_t id = camera.id;
  cameras[id] = std::move(camera);
  return id;
}

// Points with only those observations that are still there.
std::map<std::uint64_t, ColmapPoint> SelectPoints(const SparseModel& given, const SparseModel& kept) {
  std::map<std::uint64_t, ColmapPoint> points;
  for (const auto& [id, point] : given.points) {
    ColmapPoint copy = point;
    std::erase_if(copy.track,
                  [&](const ColmapPoint::Track& track) { return !kept.images.contains(track.image_id); });
    if (!copy.track.empty()) points[id] = std::move(copy);
  }
  return points;
}

}  // namespace

SparseModel SelectKnownPoses(const SparseModel& given, const std::vector<ListedView>& views,
                             const std::string& where) {
  const ImagesByName index = IndexByName(given);
  SparseModel kept;
  kept.offset = given.offset;
  for (const ListedView& view : views) {
    const ColmapImage* image = FindImage(index, view.name, where);
    if (!image) continue;
    const ColmapCamera& camera = given.cameras.at(image->camera_id);
    ColmapImage& adapted = kept.images[image->id] = AdaptImage(*image, camera, view);
    adapted.camera_id = AddCamera(view.width > 0 ? Resized(camera, view.width, view.height) : camera,
                                  given.cameras.rbegin()->first, kept.cameras);
  }
  RequireTwo(kept, given, views, where);
  kept.points = SelectPoints(given, kept);
  return kept;
}

std::size_t CountKnownPoses(const SparseModel& given, const std::vector<std::string>& views) {
  const ImagesByName index = IndexByName(given);
  return std::size_t(std::ranges::count_if(views, [&](const std::string& view) {
    return std::ranges::any_of(index, [&](const auto& images) { return images.contains(view); });
  }));
}

namespace {

// Which of the given cameras became this one of the model's: that of the same image.
std::uint32_t GivenCamera(std::uint32_t id, const SparseModel& model, const SparseModel& given) {
  const auto image =
      std::ranges::find_if(model.images, [&](const auto& entry) { return entry.second.camera_id == id; });
  return given.images.at(image->first).camera_id;
}

}  // namespace

SparseModel ReadKnownPoses(const fs::path& folder, const std::vector<ListedView>& views, Progress& progress) {
  std::vector<std::string> notes;
  const SparseModel given = ReadSparseModel(folder, &notes);
  SparseModel model = SelectKnownPoses(given, views, folder.string());
  for (const std::string& note : notes) progress.Warn(note);
  if (const auto names = MissingViews(model, views); !names.empty())
    progress.Warn(fmt::format(
        "{} of {} views have a known pose; the model has none for {}, which are left out ({}). Add "
        "them to the model, or take it away, so that the poses come from the pictures",
        model.images.size(), views.size(), EnumerateRuns(names, views), folder.string()));
  for (const auto& [id, camera] : model.cameras)
    if (const ColmapCamera& before = given.cameras.at(GivenCamera(id, model, given));
        before.width != camera.width)
      progress.Warn(fmt::format(
          "the known poses' camera {} is for {} x {} pixels, the pictures have {} x {}: it is scaled to them",
          before.id, before.width, before.height, camera.width, camera.height));
  return model;
}

}  // namespace polarscan
