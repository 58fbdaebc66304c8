// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/colmap/dense_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/error.h"
#include "core/files/files.h"
#include "stereo/sfm/model/camera_models.h"

namespace polarscan {
namespace {

constexpr double kHalfPixel = 0.5;
constexpr std::size_t kFewPoints = 50;
constexpr int kGrid = 5;  // stand-in points a side of the picture

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

// Adds a point that view 0 of `seers` has at the end of a ray, and all others that have it in their picture.
void AddStandIn(const Workspace& workspace, const std::vector<int>& seers, const Eigen::Vector3d& point,
                const std::map<std::string, std::uint32_t>& ids, SparseModel& sparse) {
  ColmapPoint stand_in{point, {}, 0, {}};
  const std::uint64_t id = sparse.points.empty() ? 1 : sparse.points.rbegin()->first + 1;
  for (const int seer : seers) {
    const DenseView& view = workspace.views[std::size_t(seer)];
    const Eigen::Vector3d local = view.cam_from_world * point;
    if (!view.camera.Sees(local)) continue;
    const Eigen::Vector2d pixel = view.camera.Project(local);
    ColmapImage& image = sparse.images.at(ids.at(view.name));
    stand_in.track.push_back({image.id, std::uint32_t(image.observations.size())});
    image.observations.push_back({pixel.x() - kHalfPixel, pixel.y() - kHalfPixel, std::int64_t(id)});
  }
  sparse.points[id] = std::move(stand_in);
}

void AddStandIns(const Workspace& workspace, SparseModel& sparse) {
  std::map<std::string, std::uint32_t> ids;
  for (const auto& [id, image] : sparse.images) ids[std::filesystem::path(image.name).stem().string()] = id;
  for (std::size_t i = 0; i < workspace.views.size(); ++i) {
    const DenseView& view = workspace.views[i];
    std::vector<int> seers = {int(i)};
    seers.insert(seers.end(), view.sources.begin(), view.sources.end());
    const Rigid world_from_cam = view.cam_from_world.Inverse();
    for (int k = 0; k < kGrid * kGrid; ++k) {
      const double u = (k % kGrid + 0.5) * view.camera.width / kGrid,
                   v = (k / kGrid + 0.5) * view.camera.height / kGrid;
      const double depth = k % 2 ? view.depth_min : view.depth_max;
      AddStandIn(workspace, seers, world_from_cam * Eigen::Vector3d(view.camera.Ray(u, v) * depth), ids,
                 sparse);
    }
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
  sparse.offset = model.offset;
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
  if (sparse.points.size() < kFewPoints) AddStandIns(workspace, sparse);
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
