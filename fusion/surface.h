// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <memory>
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

// Exact distance from points to the nearest triangle of some meshes (Embree point queries; the distances
// themselves in double precision). Safe to call from several threads.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(const std::vector<TriangleMesh>& meshes);
  ~SurfaceDistance();
  SurfaceDistance(SurfaceDistance&&) noexcept;

  double operator()(const Eigen::Vector3d& point) const;  // infinite if the meshes have no triangles

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Distance of a point to the triangle (a, b, c); degenerate triangles count as their edges.
double TriangleDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c);

// Distance of each query to its nearest point; infinite if there are no points. In parallel.
std::vector<double> NearestDistances(const std::vector<Eigen::Vector3d>& points,
                                     const std::vector<Eigen::Vector3d>& queries);

}  // namespace polarscan
