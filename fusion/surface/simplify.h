// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/mesh.h"
#include "fusion/mesh_topology.h"

namespace polarscan {

// The mesh with about so many triangles: edges are collapsed where that moves the surface least (quadric
// errors, by meshoptimizer), borders keep their shape, a closed surface stays closed. It may end with more
// triangles than asked for where its topology allows no fewer. Normals are computed anew.
TriangleMesh Simplify(const TriangleMesh& mesh, int faces);

// The triangles that Simplify leaves, of the mesh's own vertices.
std::vector<Triangle> CollapsedTriangles(const TriangleMesh& mesh, int faces);

}  // namespace polarscan
