// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/known_poses.h"

#include <fmt/format.h>

#include <filesystem>

#include "core/error.h"
#include "stereo/sfm/camera_models.h"

namespace polarscan {
namespace {

std::map<std::string, const ColmapImage*> ImagesByStem(const SparseModel& given, const std::string& where) {
  std::map<std::string, const ColmapImage*> images;
  for (const auto& [id, image] : given.images) {
    const auto [entry, is_new] = images.emplace(std::filesystem::path(image.name).stem().string(), &image);
    if (!is_new)
      throw Error(fmt::format("the images {} and {} of the model have the same stem", entry->second->name,
                              image.name),
                  where, "Rename them, so that each name tells which view it is");
  }
  return images;
}

[[noreturn]] void ThrowNothingMatches(const SparseModel& given, const std::vector<View>& views,
                                      const std::string& where) {
  std::vector<std::string> theirs, ours;
  for (const auto& [id, image] : given.images) theirs.push_back(image.name);
  for (const View& view : views) ours.push_back(view.name);
  throw Error(fmt::format("no image of the model belongs to a view: the model has {}; the views are {}",
                          theirs.empty() ? "no images" : Enumerate(theirs, 3), Enumerate(ours, 3)),
              where, "Names must be equal but for folder and extension; rename the images in the model");
}

// The image with its observations at the scale of the view's picture.
ColmapImage AdaptImage(ColmapImage image, const ColmapCamera& camera, const View& view) {
  const double sx = double(view.width) / camera.width, sy = double(view.height) / camera.height;
  for (ColmapImage::Observation& observation : image.observations) {
    observation.x *= sx;
    observation.y *= sy;
  }
  image.name = view.PictureName();
  return image;
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

SparseModel SelectKnownPoses(const SparseModel& given, const std::vector<View>& views,
                             const std::string& where) {
  const auto images = ImagesByStem(given, where);
  SparseModel kept;
  kept.offset = given.offset;
  for (const View& view : views) {
    const auto found = images.find(view.name);
    if (found == images.end()) continue;
    const ColmapImage& image = *found->second;
    const ColmapCamera& camera = given.cameras.at(image.camera_id);
    kept.images[image.id] = AdaptImage(image, camera, view);
    kept.cameras[camera.id] = Resized(camera, view.width, view.height);
    ToLens(kept.cameras[camera.id]);  // throws if the lens model is not supported
  }
  if (kept.images.empty()) ThrowNothingMatches(given, views, where);
  kept.points = SelectPoints(given, kept);
  return kept;
}

}  // namespace polarscan
