// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "report/scene/sample.h"

namespace polarscan {

// A cloud as the report's page gets it, quantised. bytes: positions (3 x uint16 little endian a point, in the
// box low + size), then each layer: colours (3 x uint8), normals (3 x int8), scalars (1 x uint8 from low to
// high). facts: total, shown, outside, low, size, center, radius, spacing (all in world units, display
// frame), layers [{key, label, low, high}] with keys colour, normal, dop, confidence, views, error. scalars:
// the bytes of the scalar layers by key.
struct ReportCloud {
  nlohmann::json facts;
  std::string bytes;
  std::map<std::string, std::string> scalars;
};

// The sample must not be empty.
ReportCloud PackCloud(const CloudSample& sample);

// Appends positions and sets facts low and size. Appends unit normals.
void PackPositions(const std::vector<Eigen::Vector3d>& points, nlohmann::json& facts, std::string& bytes);
void PackNormals(const std::vector<Eigen::Vector3d>& normals, std::string& bytes);
nlohmann::json ToArray(const Eigen::Vector3d& v);
Eigen::Vector3d FromArray(const nlohmann::json& array);

}  // namespace polarscan
