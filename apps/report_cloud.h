// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace polarscan {

// A cloud as the report's page gets it: at most `max_points` points, in the display frame (y up), quantised.
// bytes: positions (3 x uint16 little endian a point, in the box low + size), then colours (3 x uint8, if the
// file has them), normals (3 x int8, if any), then one uint8 a point for each scalar layer. facts: total,
// shown, outside (left out, further than 6 radii away), low, size, center, radius, spacing (all in world
// units), layers [{key, label, low, high}] with keys colour, normal, dop, confidence, views.
struct ReportCloud {
  nlohmann::json facts;
  std::string bytes;
};

// dop_full: full scale of the DoP legend; 0: from the cloud itself. Throws Error on a damaged or empty file.
ReportCloud PackCloud(const std::filesystem::path& ply, std::size_t max_points, double dop_full,
                      const Eigen::Matrix3d& display_from_world);

}  // namespace polarscan
