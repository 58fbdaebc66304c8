// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/progress.h"

namespace polarscan {

// The views of a scan as the report's page gets them.
struct ReportPictures {
  // [{name, source_names, pictures {s0, dop, aop, depth, normal, depth_error, normal_error: JPEG in base64},
  // depth {near, far, share}, camera}]; a picture that the scan does not hold is missing. camera: {center,
  // corners} in the display frame, corners being the directions with depth 1 through the picture's corners
  // (top left, top right, bottom right, bottom left).
  nlohmann::json views = nlohmann::json::array();
  double dop_noise = 0;  // median of the views' (report/pictures.h)
  double dop_full = 0;   // full scale of the DoP pictures; 0: no view is polarized
  // y up (the mean of the cameras' upward axes), z towards where the cameras stand.
  Eigen::Matrix3d display_from_world = Eigen::Matrix3d::Identity();
  std::vector<std::string> notes;  // what is missing or damaged, in words
};

// From dense/ if the scan has it, else from views/. Longest side of a picture at most 320 px, less for many
// views.
ReportPictures CollectViews(const std::filesystem::path& scan_folder, Progress& progress);

}  // namespace polarscan
