// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/dense_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/error.h"
#include "core/files.h"
#include "stereo/sfm/camera_models.h"

namespace polarscan {
namespace {

constexpr double kHalfPixel = 0.5;

ColmapCamera ExportCamera(std::uint32_t id, const Pinhole& c) {
  return {id, "PINHOLE", c.width, c.height, {c.fx, c.fy, c.cx - kHalfPixel, c.cy - kHalfPixel}};
}

// Observations in the new picture, in the coordinates of the exported camera.
void MoveObservations(ColmapImage& image, const Lens& lens, const Pinhole& camera) {
  const Pinhole& old = lens.pinhole;
  for (ColmapImage::Observation& o : image.observations) {
    const Eigen::Vector2d ray = lens.Undistort({(o.x - old.cx) / old.fx, (o.y - old.cy) / old.fy});
    o.x = camera.fx * ray.x() + camera.cx - kHalfPixel;
    o.y = camera.fy * ray.y() + camera.cy - kHalfPixel;
  }
}

std::string PatchMatchConfig(const Workspace& workspace) {
  std::string text;
  for (const DenseView& view : workspace.views) {
    std::vector<std::string> names;
    for (const int source : view.sources) names.push_back(workspace.views[std::size_t(source)].name + ".png");
    text += fmt::format("{}.png\n{}\n", view.name,
                        names.empty() ? "__auto__, 20" : fmt::format("{}", fmt::join(names, ", ")));
  }
  return text;
}

std::string FusionConfig(const Workspace& workspace) {
  std::string text;
  for (const DenseView& view : workspace.views) text += view.name + ".png\n";
  return text;
}

}  // namespace

SparseModel ColmapSparse(const Workspace& workspace, const SparseModel& model) {
  std::map<std::string, const ColmapImage*> images;
  for (const auto& [id, image] : model.images) images[image.name] = &image;
  SparseModel sparse;
  for (const DenseView& view : workspace.views) {
    const auto found = images.find(view.name + ".png");
    if (found == images.end())
      throw Error("the sparse model lacks a view", view.name, "Run structure from motion again");
    ColmapImage image = *found->second;
    MoveObservations(image, ToLens(model.cameras.at(image.camera_id)), view.camera);
    image.cam_from_world = view.cam_from_world;
    image.camera_id = std::uint32_t(sparse.cameras.size() + 1);  // a camera each: sizes may differ
    sparse.cameras[image.camera_id] = ExportCamera(image.camera_id, view.camera);
    sparse.images[image.id] = std::move(image);
  }
  for (const auto& [id, point] : model.points) {
    ColmapPoint kept = point;
    std::erase_if(kept.track,
                  [&](const ColmapPoint::Track& track) { return !sparse.images.contains(track.image_id); });
    if (kept.track.size() >= 2) sparse.points[id] = std::move(kept);
  }
  for (auto& [id, image] : sparse.images)
    for (ColmapImage::Observation& o : image.observations)
      if (o.point_id >= 0 && !sparse.points.contains(std::uint64_t(o.point_id))) o.point_id = -1;
  return sparse;
}

void WriteColmapWorkspace(const Workspace& workspace, const SparseModel& model) {
  WriteSparseModelBinary(workspace.folder / "sparse", ColmapSparse(workspace, model));
  const auto stereo = workspace.folder / "stereo";
  for (const char* name : {"depth_maps", "normal_maps", "consistency_graphs"}) CreateFolder(stereo / name);
  WriteFileAtomically(stereo / "patch-match.cfg", PatchMatchConfig(workspace));
  WriteFileAtomically(stereo / "fusion.cfg", FusionConfig(workspace));
}

}  // namespace polarscan
