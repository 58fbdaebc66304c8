// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/model/model.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <sstream>

#include "core/error.h"
#include "core/files/files.h"
#include "core/words.h"
#include "stereo/sfm/model/model_files.h"
#include "stereo/sfm/view_list.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

bool HoldsModel(const fs::path& folder) {
  return fs::exists(folder / "cameras.bin") || fs::exists(folder / "cameras.txt");
}

// Sorted.
std::vector<fs::path> FoldersIn(const fs::path& folder) {
  std::vector<fs::path> found;
  if (!fs::is_directory(folder)) return found;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_directory()) found.push_back(entry.path());
  std::ranges::sort(found);
  return found;
}

// References between the three files; what COLMAP itself relies on.
void CheckReferences(const SparseModel& model, const fs::path& folder) {
  const std::string advice = "Copy it again from where it came, or make it anew";
  for (const auto& [id, image] : model.images)
    if (!model.cameras.contains(image.camera_id))
      throw Error(
          fmt::format("the COLMAP model has no camera {}, which image {} is of", image.camera_id, image.name),
          folder.string(), "Give each image's line the number of a camera that is there");
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

bool IsStretched(const double* pose) {
  return std::abs(Eigen::Vector4d(pose[0], pose[1], pose[2], pose[3]).norm() - 1) > 1e-3;
}

void AddNoteOnLengths(const std::vector<std::string>& stretched, const fs::path& path,
                      std::vector<std::string>& notes) {
  if (!stretched.empty())
    notes.push_back(fmt::format(
        "the quaternions of {} are not of length 1 ({}): they are taken for their direction. Check "
        "that QW comes first, and that they are quaternions",
        Enumerate(stretched), path.string()));
}

fs::path FindSparseModel(const fs::path& folder) {
  if (HoldsModel(folder)) return folder;
  std::vector<fs::path> models;
  std::vector<std::string> names;
  for (const fs::path& below : FoldersIn(folder))
    if (HoldsModel(below)) models.push_back(below), names.push_back(below.filename().string());
  if (models.size() == 1) return models[0];
  if (!models.empty())
    throw Error(fmt::format("there are {} COLMAP models here ({})", models.size(), Enumerate(names)),
                folder.string(), "Leave only the one that is meant, or move its files into this folder");
  throw Error("no COLMAP model here (cameras.bin or cameras.txt)", folder.string(),
              "Give the folder that holds cameras, images and points3D");
}

SparseModel ReadSparseModel(const fs::path& path, std::vector<std::string>* notes) {
  const fs::path folder = FindSparseModel(path);
  const bool binary = fs::exists(folder / "cameras.bin");
  const fs::path images = folder / (binary ? "images.bin" : "images.txt");
  if (!fs::exists(images))
    throw Error(fmt::format("the COLMAP model lacks {}", images.filename().string()), folder.string(),
                "It needs cameras and images, both as .bin or both as .txt");
  std::vector<std::string> unread;
  SparseModel model = binary ? ReadBinaryModel(folder, notes ? *notes : unread)
                             : ReadTextModel(folder, notes ? *notes : unread);
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
