// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "report/scene/cloud.h"

namespace polarscan {

// A mesh as the report's page gets it: at most about `max_faces` triangles (quadric simplification,
// meshoptimizer), in the display frame, quantised. bytes: triangles (3 x uint32 little endian), positions (3
// x uint16 a vertex), then each layer as in ReportCloud. Colours are the mesh's own where it has them; scalar
// layers are those of the nearest point of the cloud. facts: total (faces of the file), shown, vertices, low,
// size, center, radius, layers.
struct ReportMesh {
  nlohmann::json facts;
  std::string bytes;
};

// sample, cloud: may be empty. Throws Error on a damaged file or one without triangles.
ReportMesh PackMesh(const std::filesystem::path& ply, std::size_t max_faces,
                    const Eigen::Matrix3d& display_from_world, const CloudSample& sample,
                    const ReportCloud& cloud);

}  // namespace polarscan
