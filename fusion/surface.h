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

struct Neighbour {
  std::uint32_t index = 0;  // into the points
  double distance;
};

// The nearest point of each query; at an infinite distance if there are no points. In parallel.
std::vector<Neighbour> FindNearest(const std::vector<Eigen::Vector3d>& points,
                                   const std::vector<Eigen::Vector3d>& queries);
std::vector<double> NearestDistances(const std::vector<Eigen::Vector3d>& points,
                                     const std::vector<Eigen::Vector3d>& queries);

}  // namespace polarscan
