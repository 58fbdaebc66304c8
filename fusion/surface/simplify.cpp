// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/simplify.h"

#include <meshoptimizer.h>

#include <vector>

#include "fusion/mesh_topology.h"

namespace polarscan {

std::vector<Triangle> CollapsedTriangles(const TriangleMesh& mesh, int faces) {
  constexpr float kAnyError = 1;  // as a share of the mesh's extent: the count decides
  std::vector<float> positions;
  for (const Eigen::Vector3d& v : mesh.vertices)
    for (int k = 0; k < 3; ++k) positions.push_back(float(v[k]));
  std::vector<unsigned> indices, left;
  for (const Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
  left.resize(indices.size());
  left.resize(meshopt_simplify(left.data(), indices.data(), indices.size(), positions.data(),
                               mesh.vertices.size(), 3 * sizeof(float), 3 * std::size_t(faces), kAnyError, 0,
                               nullptr));
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i < left.size(); i += 3) triangles.push_back({left[i], left[i + 1], left[i + 2]});
  return triangles;
}

TriangleMesh Simplify(const TriangleMesh& mesh, int faces) {
  TriangleMesh simple{mesh.vertices, {}, CollapsedTriangles(mesh, faces)};
  simple = KeepTriangles(simple, std::vector<bool>(simple.triangles.size(), true)).mesh;
  ComputeVertexNormals(simple);
  return simple;
}

}  // namespace polarscan
