// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/known_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>

#include "core/error.h"
#include "core/view_name.h"
#include "stereo/sfm/camera_models.h"

namespace polarscan {
namespace {

// Images by every name that their view may have: of images/cam1/0.jpg images-cam1-0, cam1-0, 0.
using NamedImages = std::multimap<std::string, const ColmapImage*>;

NamedImages ImagesByName(const SparseModel& given) {
  NamedImages images;
  for (const auto& [id, image] : given.images)
    for (std::filesystem::path rest = image.name; !rest.empty();) {
      images.emplace(ViewName(rest), &image);
      rest = rest.has_parent_path() ? rest.lexically_relative(*rest.begin()) : std::filesystem::path();
    }
  return images;
}

// The one image of that name, or the one whose whole path it is; null: none.
const ColmapImage* ImageOf(const std::string& view, const NamedImages& images, const std::string& where) {
  const auto [begin, end] = images.equal_range(view);
  if (begin == end || std::next(begin) == end) return begin == end ? nullptr : begin->second;
  const auto whole =
      std::find_if(begin, end, [&](const auto& image) { return ViewName(image.second->name) == view; });
  if (whole != end) return whole->second;
  throw Error(fmt::format("the images {} and {} of the model have the same stem", begin->second->name,
                          std::next(begin)->second->name),
              where, "Rename them, so that each name tells which view it is");
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
  const NamedImages images = ImagesByName(given);
  SparseModel kept;
  for (const View& view : views) {
    const ColmapImage* found = ImageOf(view.name, images, where);
    if (!found) continue;
    const ColmapImage& image = *found;
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
