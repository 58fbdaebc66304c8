// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>

#include "core/mesh.h"
#include "fusion/mesh_topology.h"

namespace polarscan {

// The largest distance of a vertex from the unit sphere.
inline double FarthestFromSphere(const TriangleMesh& mesh) {
  double worst = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) worst = std::max(worst, std::abs(v.norm() - 1));
  return worst;
}

inline bool IsClosed(const TriangleMesh& mesh) { return BorderLoops(mesh.triangles).empty(); }

}  // namespace polarscan
