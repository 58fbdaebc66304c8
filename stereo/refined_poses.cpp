// SPDX-License-Identifier: Apache-2.0
#include "stereo/refined_poses.h"

#include <fmt/format.h>

#include <cmath>

#include "core/error.h"
#include "core/files/files.h"
#include "core/words.h"

namespace polarscan {
namespace {

using nlohmann::json;

constexpr const char* kRemove = "Remove it, and run polarscan stereo again";

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

json PosesToJson(const PosesByName& poses) {
  json value = json::object();
  for (const auto& [name, pose] : poses) value[name] = PoseToJson(pose);
  return value;
}

PosesByName PosesFromJson(const json& value, const std::filesystem::path& path) {
  PosesByName poses;
  for (const auto& [name, numbers] : value.items()) {
    const Rigid pose = poses[name] = PoseFromJson(numbers);
    if (!(std::abs(pose.rotation.determinant() - 1) < 1e-6) || !pose.translation.allFinite())
      throw Error(fmt::format("the pose of view {} is none", name), path.string(), kRemove);
  }
  return poses;
}

void Apply(const PosesByName& poses, Workspace& workspace) {
  for (DenseView& view : workspace.views) {
    const auto pose = poses.find(view.name);
    if (pose != poses.end()) view.cam_from_world = pose->second;
  }
}

}  // namespace

std::optional<RefinedPoses> ReadRefinedPoses(const std::filesystem::path& dense) {
  const auto path = PosesPath(dense);
  if (!std::filesystem::exists(path)) return std::nullopt;
  try {
    const json value = ReadJson(path);
    if (value.at("views") != HashOfViews(dense)) return std::nullopt;
    RefinedPoses refined{value.at("inputs"),
                         PosesFromJson(value.at("start"), path),
                         {},
                         value.at("median_px"),
                         value.at("worst_px"),
                         value.at("worst")};
    for (const json& fit : value.at("fits")) refined.fits.push_back(PosesFromJson(fit, path));
    return refined;
  } catch (const json::exception& problem) {
    throw Error(fmt::format("damaged poses ({})", JsonReason(problem.what())), path.string(), kRemove);
  }
}

void WriteRefinedPoses(const std::filesystem::path& dense, const RefinedPoses& refined) {
  json fits = json::array();
  for (const PosesByName& fit : refined.fits) fits.push_back(PosesToJson(fit));
  WriteJson(PosesPath(dense), {{"start", PosesToJson(refined.start)},
                               {"fits", fits},
                               {"median_px", refined.median_px},
                               {"worst_px", refined.worst_px},
                               {"worst", refined.worst},
                               {"views", HashOfViews(dense)},
                               {"inputs", refined.inputs}});
}

void RemoveRefinedPoses(const std::filesystem::path& dense) { std::filesystem::remove(PosesPath(dense)); }

Workspace WithPoses(Workspace workspace, const RefinedPoses& refined, std::size_t fits) {
  Apply(refined.start, workspace);
  for (std::size_t i = 0; i < std::min(fits, refined.fits.size()); ++i) Apply(refined.fits[i], workspace);
  return workspace;
}

Workspace WithPoses(Workspace workspace, const RefinedPoses& refined) {
  return WithPoses(std::move(workspace), refined, refined.fits.size());
}

}  // namespace polarscan
