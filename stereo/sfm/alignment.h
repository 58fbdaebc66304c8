// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/similarity.h"
#include "stereo/sfm/model/model.h"
#include "stereo/workspace.h"

namespace polarscan {

// An estimated camera in the scan's own frame.
struct NamedPose {
  std::string name;  // stem of the picture's name
  Rigid cam_from_world;
};
std::vector<NamedPose> Poses(const Workspace& workspace);
std::vector<NamedPose> Poses(const SparseModel& model);

// What is left between estimated cameras and true ones after an alignment.
struct AlignmentErrors {
  int cameras = 0;          // of the same name in both
  double scale = 1;         // of the alignment
  double rms = 0, max = 0;  // distance of the centres, units of the truth
  double rotation_deg = 0;  // mean angle between the cameras' orientations
  std::string worst;        // the view with the greatest distance
};
nlohmann::json ToJson(const AlignmentErrors& errors);
AlignmentErrors ReadAlignmentErrors(const nlohmann::json& object);

// The similarity of camera centres that takes an estimate to the truth.
struct Alignment {
  Similarity truth_from_scan;
  AlignmentErrors errors;
};

// Cameras match by the stem of their names. Throws Error if fewer than three match or they lie on one line.
Alignment AlignCameras(const std::vector<NamedPose>& estimated, const std::vector<NamedPose>& truth);

}  // namespace polarscan
