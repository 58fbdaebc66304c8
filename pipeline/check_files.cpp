// SPDX-License-Identifier: Apache-2.0
#include "pipeline/check_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "acquisition/input/forms/stokes.h"
#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/exr.h"
#include "core/formats/image_io.h"
#include "core/formats/ply.h"
#include "stereo/map_io.h"
#include "stereo/sfm/model/model.h"
#include "stereo/workspace.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr double kUnit = 1e-3;  // of a normal's length

bool AllFinite(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double v) { return std::isfinite(v); });
}

void CheckDepths(const Image<float>& depth, const fs::path& path) {
  for (const float value : depth.pixels())
    if (!std::isfinite(value) || value < 0)
      throw Error(fmt::format("a depth of {} in the map", value), path.string());
}

void CheckNormals(const Image<Eigen::Vector3f>& normals, const fs::path& path) {
  for (const Eigen::Vector3f& normal : normals.pixels()) {
    const double length = normal.cast<double>().norm();
    if (!(length == 0 || std::abs(length - 1) < kUnit))
      throw Error(fmt::format("a normal of length {} in the map", length), path.string());
  }
}

// "640&480&3&..."
bool HoldsNormals(const fs::path& path) {
  const std::string bytes = ReadFile(path);
  std::size_t end = bytes.find('&');
  if (end != std::string::npos) end = bytes.find('&', end + 1);
  return end != std::string::npos && bytes.compare(end + 1, 2, "3&") == 0;
}

void CheckFaces(const PlyElement& faces, std::size_t vertices, const fs::path& path) {
  for (const auto& [name, rows] : faces.lists)
    for (const std::vector<std::uint32_t>& row : rows)
      if (std::ranges::any_of(row, [&](std::uint32_t index) { return index >= vertices; }))
        throw Error("a face of vertices that do not exist", path.string());
}

void CheckImage(const ColmapImage& image, const SparseModel& model, const fs::path& folder) {
  const std::string name = (folder / "images").string();
  if (!model.cameras.contains(image.camera_id))
    throw Error(fmt::format("picture {} has a camera that does not exist", image.name), name);
  if (!image.cam_from_world.rotation.allFinite() || !image.cam_from_world.translation.allFinite())
    throw Error(fmt::format("picture {} has an impossible pose", image.name), name);
  for (const ColmapImage::Observation& o : image.observations)
    if (!std::isfinite(o.x) || !std::isfinite(o.y) ||
        (o.point_id >= 0 && !model.points.contains(std::uint64_t(o.point_id))))
      throw Error(fmt::format("picture {} observes a point that does not exist", image.name), name);
}

void CheckPoint(std::uint64_t id, const ColmapPoint& point, const SparseModel& model,
                const fs::path& folder) {
  const auto exists = [&](const ColmapPoint::Track& track) {
    const auto image = model.images.find(track.image_id);
    return image != model.images.end() && track.observation < image->second.observations.size();
  };
  if (!point.position.allFinite() || !std::isfinite(point.error_px) ||
      !std::ranges::all_of(point.track, exists))
    throw Error(fmt::format("point {} has impossible values, or was seen by nobody who exists", id),
                (folder / "points3D").string());
}

}  // namespace

void CheckMap(const fs::path& path) {
  if (HoldsNormals(path)) return CheckNormals(ReadNormalMap(path), path);
  CheckDepths(ReadDepthMap(path), path);
}

void CheckPly(const fs::path& path) {
  const PlyFile file = ReadPly(path);
  const auto vertex = file.find("vertex");
  if (vertex == file.end()) throw Error("the PLY file has no vertices", path.string());
  for (const char* name : {"x", "y", "z"})
    if (!vertex->second.columns.contains(name))
      throw Error(fmt::format("the vertices have no {}", name), path.string());
  for (const auto& [name, column] : vertex->second.columns)
    if (!AllFinite(column)) throw Error(fmt::format("a vertex whose {} is no number", name), path.string());
  if (const auto face = file.find("face"); face != file.end())
    CheckFaces(face->second, vertex->second.count, path);
}

void CheckModel(const fs::path& folder) {
  const SparseModel model = ReadSparseModel(folder);
  for (const auto& [id, camera] : model.cameras)
    if (camera.width <= 0 || camera.height <= 0 || !AllFinite(camera.params))
      throw Error(fmt::format("camera {} has impossible values", id), (folder / "cameras").string());
  for (const auto& [id, image] : model.images) CheckImage(image, model, folder);
  for (const auto& [id, point] : model.points) CheckPoint(id, point, model, folder);
}

void CheckWorkspace(const fs::path& folder) {
  Progress silent;
  CheckWorkspace(folder, silent);
}

void CheckWorkspace(const fs::path& folder, Progress& progress) {
  const Workspace workspace = ReadWorkspace(folder);
  const auto check_size = [&](const auto& map, int view, const fs::path& path) {
    const Pinhole& camera = workspace.views[std::size_t(view)].camera;
    if (map.width() != camera.width || map.height() != camera.height)
      throw Error(fmt::format("the map has {} x {} pixels, its camera {} x {}", map.width(), map.height(),
                              camera.width, camera.height),
                  path.string());
  };
  progress.Begin("checking the views", workspace.views.size());
  for (int view = 0; view < int(workspace.views.size()); ++view, progress.Advance()) {
    progress.Check();
    ReadViewLight(workspace, view);
    ReadViewMask(workspace, view);
    for (const MapKind& kind : kResults) {
      if (const fs::path path = workspace.DepthPath(view, kind); fs::exists(path)) {
        const Image<float> depth = ReadDepthMap(path);
        check_size(depth, view, path);
        CheckDepths(depth, path);
      }
      if (const fs::path path = workspace.NormalPath(view, kind); fs::exists(path)) {
        const Image<Eigen::Vector3f> normals = ReadNormalMap(path);
        check_size(normals, view, path);
        CheckNormals(normals, path);
      }
    }
  }
}

void CheckPicture(const fs::path& path) {
  if (path.extension() == ".exr" && HoldStokesChannels(ExrChannels(path))) {
    ReadStokesFile(path);
    return;
  }
  const Picture picture = ReadPicture(path);
  const bool tiff = path.extension() == ".tif" || path.extension() == ".tiff";
  if (tiff && picture.bits == 32) ReadFloatTiff(path);  // all of its pages
}

}  // namespace polarscan
