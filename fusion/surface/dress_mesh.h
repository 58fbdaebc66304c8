// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/mesh.h"
#include "fusion/mesh_files.h"

namespace polarscan {

// The mesh with what the cloud knows at its vertices: colour, DoP, confidence and views are means over the
// six nearest points, weighted by 1 / (1 + (distance / cell)^2). Where none lies within `limit` (world units)
// only the colour is: nothing was seen there. Normals are the mesh's.
SurfaceMesh DressMesh(const TriangleMesh& mesh, const std::vector<CloudPoint>& cloud, double cell,
                      double limit);

}  // namespace polarscan
