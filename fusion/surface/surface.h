// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/mesh.h"

namespace polarscan {

struct SurfaceSample {
  Eigen::Vector3d position, normal;  // unit normal of the triangle, outward
};

double SurfaceArea(const TriangleMesh& mesh);

// `count` points uniform by area; the same for the same seed. Throws Error if the mesh has no area.
std::vector<SurfaceSample> SampleSurface(const TriangleMesh& mesh, int count, std::uint64_t seed);

// Greatest distance of a vertex from the centre of the bounding box.
double BoundingRadius(const TriangleMesh& mesh);

}  // namespace polarscan
