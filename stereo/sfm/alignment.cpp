// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/alignment.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>

#include "core/error.h"

namespace polarscan {
namespace {

struct CameraPair {
  std::string name;
  Rigid estimated, truth;
};

std::vector<CameraPair> Match(const std::vector<NamedPose>& estimated, const std::vector<NamedPose>& truth) {
  std::map<std::string, Rigid> by_name;
  for (const NamedPose& pose : truth) by_name.emplace(pose.name, pose.cam_from_world);
  std::vector<CameraPair> pairs;
  for (const NamedPose& pose : estimated)
    if (const auto found = by_name.find(pose.name); found != by_name.end())
      pairs.push_back({pose.name, pose.cam_from_world, found->second});
  return pairs;
}

// Angle of a rotation by its Frobenius distance to identity: |R - I| = 2 sqrt(2) sin(angle / 2).
double AngleDeg(const Eigen::Matrix3d& rotation) {
  const double sine = (rotation - Eigen::Matrix3d::Identity()).norm() / (2 * std::sqrt(2.0));
  return 2 * std::asin(std::min(1.0, sine)) * 180 / std::numbers::pi;
}

std::string FirstName(const std::vector<NamedPose>& poses) {
  return poses.empty() ? "none" : fmt::format("{}{}", poses[0].name, poses.size() > 1 ? " and so on" : "");
}

}  // namespace

std::vector<NamedPose> Poses(const Workspace& workspace) {
  std::vector<NamedPose> poses;
  for (const DenseView& view : workspace.views) poses.push_back({view.name, view.cam_from_world});
  return poses;
}

std::vector<NamedPose> Poses(const SparseModel& model) {
  std::vector<NamedPose> poses;
  for (const auto& [id, image] : model.images)
    poses.push_back({std::filesystem::path(image.name).stem().string(), image.cam_from_world});
  return poses;
}

Alignment AlignCameras(const std::vector<NamedPose>& estimated, const std::vector<NamedPose>& truth) {
  const std::vector<CameraPair> pairs = Match(estimated, truth);
  if (pairs.size() < 3)
    throw Error(fmt::format("{} of {} estimated cameras have a true pose of the same name, three are needed",
                            pairs.size(), estimated.size()),
                fmt::format("the scan has {}, the true poses {}", FirstName(estimated), FirstName(truth)),
                "Names are compared without folder and extension");
  std::vector<Eigen::Vector3d> from, to;
  for (const CameraPair& pair : pairs) {
    from.push_back(pair.estimated.Center());
    to.push_back(pair.truth.Center());
  }
  const Similarity truth_from_scan = EstimateSimilarity(from, to);
  AlignmentErrors errors;
  errors.cameras = int(pairs.size()), errors.scale = truth_from_scan.scale;
  const double n = double(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double distance = (truth_from_scan * from[i] - to[i]).norm();
    errors.rms += distance * distance / n;
    if (distance >= errors.max) errors.max = distance, errors.worst = pairs[i].name;
    const Eigen::Matrix3d moved = truth_from_scan(pairs[i].estimated).rotation;
    errors.rotation_deg += AngleDeg(moved * pairs[i].truth.rotation.transpose()) / n;
  }
  errors.rms = std::sqrt(errors.rms);
  return {truth_from_scan, errors};
}

nlohmann::json ToJson(const AlignmentErrors& e) {
  return {{"cameras", e.cameras}, {"scale", e.scale},        {"centre_rms", e.rms},
          {"centre_max", e.max},  {"worst_camera", e.worst}, {"rotation_degrees", e.rotation_deg}};
}

AlignmentErrors ReadAlignmentErrors(const nlohmann::json& object) {
  return {object.at("cameras"),          object.at("scale"),
          object.at("centre_rms"),       object.at("centre_max"),
          object.at("rotation_degrees"), object.at("worst_camera")};
}

}  // namespace polarscan
