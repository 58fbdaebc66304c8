// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh.h"

namespace polarscan {

using Triangle = std::array<std::uint32_t, 3>;

// The vertices that share an edge with each vertex, ascending; all lists one after the other. And the
// triangles that it belongs to.
class VertexNeighbours {
 public:
  VertexNeighbours(std::size_t vertices, std::span<const Triangle> triangles);
  std::span<const std::uint32_t> Of(std::size_t vertex) const {
    return std::span(neighbours_).subspan(begin_[vertex], begin_[vertex + 1] - begin_[vertex]);
  }
  // Where the list of a vertex begins among all lists; all of them for the number of vertices.
  std::size_t Begin(std::size_t vertex) const { return begin_[vertex]; }
  std::span<const std::uint32_t> TrianglesOf(std::size_t vertex) const {
    return std::span(triangles_).subspan(first_[vertex], first_[vertex + 1] - first_[vertex]);
  }

 private:
  std::vector<std::size_t> begin_, first_;
  std::vector<std::uint32_t> neighbours_, triangles_;
};

// The connected piece that each triangle belongs to: triangles that share a vertex lie in one piece. Pieces
// are numbered 0, 1, ... in the order of their first triangle.
struct Pieces {
  std::vector<int> of_triangle;
  int count = 0;
};
Pieces FindPieces(std::size_t vertices, std::span<const Triangle> triangles);

// Border loops as lists of vertices, each in the order in which triangles that fill it would pass them. None:
// the surface is closed.
std::vector<std::vector<std::uint32_t>> BorderLoops(std::span<const Triangle> triangles);

// The triangles marked, and the vertices that they use; without normals. origin: of each vertex kept, its
// index in `mesh`.
struct KeptPart {
  TriangleMesh mesh;
  std::vector<std::uint32_t> origin;
};
KeptPart KeepTriangles(const TriangleMesh& mesh, const std::vector<bool>& keep);

// Four triangles for each. An edge's new vertex lies in the middle of the cubic curve that leaves both ends
// perpendicular to their normals, so a round surface stays round. marks: one for each vertex; a new one is
// marked if both ends are. Normals are computed anew.
TriangleMesh Subdivided(const TriangleMesh& mesh, std::vector<bool>& marks);

double MeanEdge(const TriangleMesh& mesh);  // length, world units
double TriangleArea(const TriangleMesh& mesh, const Triangle& triangle);

}  // namespace polarscan
