// SPDX-License-Identifier: Apache-2.0
#include "stereo/refined_poses.h"

#include <fmt/format.h>

#include <cmath>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

using nlohmann::json;

std::filesystem::path PosesPath(const std::filesystem::path& dense) { return dense / "stereo/poses.json"; }

std::string HashOfViews(const std::filesystem::path& dense) { return ToHex(HashFile(dense / "views.json")); }

json PoseToJson(const Rigid& pose) {
  json numbers = json::array();
  for (int i = 0; i < 9; ++i) numbers.push_back(pose.rotation(i / 3, i % 3));
  for (int i = 0; i < 3; ++i) numbers.push_back(pose.translation[i]);
  return numbers;
}

Rigid PoseFromJson(const json& numbers) {
  Rigid pose;
  for (int i = 0; i < 9; ++i) pose.rotation(i / 3, i % 3) = numbers.at(std::size_t(i));
  for (int i = 0; i < 3; ++i) pose.translation[i] = numbers.at(std::size_t(9 + i));
  return pose;
}

}  // namespace

std::optional<RefinedPoses> ReadRefinedPoses(const std::filesystem::path& dense) {
  const auto path = PosesPath(dense);
  if (!std::filesystem::exists(path)) return std::nullopt;
  try {
    const json value = ReadJson(path);
    if (value.at("views") != HashOfViews(dense)) return std::nullopt;
    RefinedPoses refined{
        {}, value.at("median_px"), value.at("worst_px"), value.at("worst"), value.at("inputs")};
    for (const auto& [name, numbers] : value.at("cam_from_world").items()) {
      const Rigid pose = refined.cam_from_world[name] = PoseFromJson(numbers);
      if (!(std::abs(pose.rotation.determinant() - 1) < 1e-6))
        throw Error(fmt::format("the pose of view {} is not a rotation", name), path.string(),
                    "Remove it, and run polarscan stereo again");
    }
    return refined;
  } catch (const json::exception& problem) {
    throw Error(fmt::format("damaged poses ({})", JsonReason(problem.what())), path.string(),
                "Remove it, and run polarscan stereo again");
  }
}

void WriteRefinedPoses(const std::filesystem::path& dense, const RefinedPoses& refined) {
  json poses = json::object();
  for (const auto& [name, pose] : refined.cam_from_world) poses[name] = PoseToJson(pose);
  WriteJson(PosesPath(dense), {{"cam_from_world", poses},
                               {"median_px", refined.median_px},
                               {"worst_px", refined.worst_px},
                               {"worst", refined.worst},
                               {"views", HashOfViews(dense)},
                               {"inputs", refined.inputs}});
}

void RemoveRefinedPoses(const std::filesystem::path& dense) { std::filesystem::remove(PosesPath(dense)); }

Workspace WithPoses(Workspace workspace, const RefinedPoses& refined) {
  for (DenseView& view : workspace.views) {
    const auto pose = refined.cam_from_world.find(view.name);
    if (pose != refined.cam_from_world.end()) view.cam_from_world = pose->second;
  }
  return workspace;
}

}  // namespace polarscan
