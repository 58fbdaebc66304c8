// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <memory>
#include <vector>

#include "core/image.h"

namespace polarscan {

// Triangles over shared vertices, outward by the right-hand rule. normals: one unit vector per vertex
// (area-weighted if the file had none). Units are the world's.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3d> normals;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// Unit vertex normals, each the area-weighted mean of its triangles' normals.
void ComputeVertexNormals(TriangleMesh& mesh);

// By the name's ending: .stl (ascii or binary), .obj, .ply (ascii or binary, either byte order); PLY also
// under another name. Polygons are split into fans; STL, and OBJ without normals, get the facets' where those
// meet at more than 30 degrees. Throws Error on a damaged file or another kind, and on vertices that are not
// finite points or lie beyond 1e15.
TriangleMesh ReadMesh(const std::filesystem::path& path);
// Binary little-endian PLY with normals. Atomic.
void WriteMesh(const std::filesystem::path& path, const TriangleMesh& mesh);

// Distance of a point to the triangle (a, b, c); degenerate triangles count as their edges.
double TriangleDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c);

// Casts rays at a set of meshes and measures distances to them (Embree). Hits and distances are recomputed in
// double precision from the triangle. Safe to call from several threads.
class RayCaster {
 public:
  struct Hit {
    int mesh = -1;        // index of the mesh, -1: nothing hit
    int triangle = -1;    // index in that mesh
    double distance = 0;  // along `direction` in units of its length
    double u = 0, v = 0;  // barycentric weights of the second and third vertex
  };

  explicit RayCaster(std::vector<TriangleMesh> meshes);
  ~RayCaster();
  RayCaster(RayCaster&&) noexcept;

  Hit Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  // Whether anything lies on origin + t direction for epsilon < t < limit.
  bool Occluded(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double limit = 1e30) const;
  // Exact distance from a point to the nearest triangle; infinite if there is none.
  double Distance(const Eigen::Vector3d& point) const;
  // Interpolated vertex normal (unit) at a hit.
  Eigen::Vector3d Normal(const Hit& hit) const;
  const std::vector<TriangleMesh>& meshes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace polarscan
