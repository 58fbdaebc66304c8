// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/model.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <sstream>

#include "core/error.h"
#include "core/files.h"
#include "stereo/sfm/model_files.h"

namespace polarscan {
namespace {

// References between the three files; what COLMAP itself relies on.
void CheckReferences(const SparseModel& model, const std::filesystem::path& folder) {
  const std::string advice = "Copy it again from where it came, or make it anew";
  for (const auto& [id, image] : model.images)
    if (!model.cameras.contains(image.camera_id))
      throw Error(fmt::format("damaged COLMAP model: image {} has no camera {}", image.name, image.camera_id),
                  folder.string(), advice);
  for (const auto& [id, point] : model.points) {
    if (!point.position.allFinite())
      throw Error(fmt::format("damaged COLMAP model: point {} is nowhere", id), folder.string(), advice);
    for (const ColmapPoint::Track& track : point.track) {
      const auto image = model.images.find(track.image_id);
      if (image == model.images.end() || track.observation >= image->second.observations.size())
        throw Error(fmt::format("damaged COLMAP model: point {} is seen by something that is not there", id),
                    folder.string(), advice);
    }
  }
}

}  // namespace

std::array<double, 7> GetPose(const Rigid& pose) {
  const Eigen::Quaterniond q(pose.rotation);
  const double sign = q.w() < 0 ? -1 : 1;
  const Eigen::Vector3d& t = pose.translation;
  return {sign * q.w(), sign * q.x(), sign * q.y(), sign * q.z(), t.x(), t.y(), t.z()};
}

bool SetPose(const double* v, Rigid& pose) {
  const Eigen::Quaterniond q(v[0], v[1], v[2], v[3]);
  pose.translation = {v[4], v[5], v[6]};
  if (!(q.norm() > 1e-6) || !q.coeffs().allFinite() || !pose.translation.allFinite()) return false;
  pose.rotation = q.normalized().toRotationMatrix();
  return true;
}

SparseModel ReadSparseModel(const std::filesystem::path& folder) {
  const bool binary = std::filesystem::exists(folder / "cameras.bin");
  if (!binary && !std::filesystem::exists(folder / "cameras.txt"))
    throw Error("no COLMAP model here (cameras.bin or cameras.txt)", folder.string(),
                "Give the folder that holds cameras, images and points3D");
  SparseModel model = binary ? ReadBinaryModel(folder) : ReadTextModel(folder);
  CheckReferences(model, folder);
  model.offset = ReadOffset(folder);
  return model;
}

Eigen::Vector3d ReadOffset(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / "offset.txt";
  if (!std::filesystem::exists(path)) return Eigen::Vector3d::Zero();
  std::istringstream text(ReadFile(path));
  Eigen::Vector3d offset;
  if (!(text >> offset.x() >> offset.y() >> offset.z()) || !offset.allFinite())
    throw Error("this holds no offset: three numbers, x y z", path.string(),
                "Write them, or remove the file if the coordinates are those that you want");
  return offset;
}

void WriteOffset(const std::filesystem::path& folder, const Eigen::Vector3d& offset) {
  if (offset.isZero(0)) return;
  WriteFileAtomically(folder / "offset.txt", fmt::format("{} {} {}\n", offset.x(), offset.y(), offset.z()));
}

void MoveOrigin(SparseModel& model, const Eigen::Vector3d& origin) {
  for (auto& [id, image] : model.images)
    image.cam_from_world.translation += image.cam_from_world.rotation * origin;
  for (auto& [id, point] : model.points) point.position -= origin;
  model.offset += origin;
}

}  // namespace polarscan
