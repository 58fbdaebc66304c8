// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <optional>
#include <string>

#include "stereo/workspace.h"

namespace polarscan {

// stereo/poses.json: poses that fit the surface better than those of views.json, which they were made from.
struct RefinedPoses {
  std::map<std::string, Rigid> cam_from_world;  // by view; views that are missing keep theirs
  double median_px = 0;                         // how far they moved the surface in the pictures
  double worst_px = 0;
  std::string worst;   // the view that moved so far
  std::string inputs;  // a hash of what they were found from
};

// None if there is no such file, or views.json is another one by now. Throws Error if it is damaged.
std::optional<RefinedPoses> ReadRefinedPoses(const std::filesystem::path& dense);
void WriteRefinedPoses(const std::filesystem::path& dense, const RefinedPoses& refined);
void RemoveRefinedPoses(const std::filesystem::path& dense);

// With these poses.
Workspace WithPoses(Workspace workspace, const RefinedPoses& refined);

}  // namespace polarscan
