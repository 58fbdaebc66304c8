// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/fill_holes.h"

#include <algorithm>
#include <utility>

#include "fusion/mesh_topology.h"
#include "fusion/surface/membranes.h"

namespace polarscan {
namespace {

bool IsFar(const Triangle& t, const std::vector<bool>& far) { return far[t[0]] || far[t[1]] || far[t[2]]; }

// A vertex in the middle of each hole, and a fan around it.
void CapHoles(TriangleMesh& mesh, std::vector<bool>& far) {
  for (const std::vector<std::uint32_t>& loop : BorderLoops(mesh.triangles)) {
    const auto middle = std::uint32_t(mesh.vertices.size());
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < loop.size(); ++i) {
      sum += mesh.vertices[loop[i]];
      mesh.triangles.push_back({loop[i], loop[(i + 1) % loop.size()], middle});
    }
    mesh.vertices.push_back(sum / double(loop.size()));
    far.push_back(true);
  }
}

// Area and number of near vertices of each piece.
struct Extent {
  double area = 0;
  bool has_near = false;
};

std::vector<Extent> Measure(const TriangleMesh& mesh, const Pieces& pieces, const std::vector<bool>& far) {
  std::vector<Extent> extents(std::size_t(pieces.count));
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    Extent& extent = extents[std::size_t(pieces.of_triangle[i])];
    extent.area += TriangleArea(mesh, t);
    extent.has_near = extent.has_near || !far[t[0]] || !far[t[1]] || !far[t[2]];
  }
  return extents;
}

void Keep(TriangleMesh& mesh, std::vector<bool>& far, const std::vector<bool>& keep) {
  KeptPart part = KeepTriangles(mesh, keep);
  std::vector<bool> still_far;
  for (std::uint32_t v : part.origin) still_far.push_back(far[v]);
  mesh = std::move(part.mesh), far = std::move(still_far);
}

void DropPieces(TriangleMesh& mesh, std::vector<bool>& far, double smallest, HoleCounts& counts) {
  const Pieces pieces = FindPieces(mesh.vertices.size(), mesh.triangles);
  const std::vector<Extent> extents = Measure(mesh, pieces, far);
  double largest = 0;
  for (const Extent& e : extents)
    if (e.has_near) largest = std::max(largest, e.area);
  const auto stays = [&](int piece) {
    const Extent& e = extents[std::size_t(piece)];
    return e.has_near && e.area >= smallest * largest;
  };
  std::vector<bool> keep;
  for (int piece : pieces.of_triangle) keep.push_back(stays(piece));
  for (int piece = 0; piece < pieces.count; ++piece) counts.pieces += !stays(piece);
  Keep(mesh, far, keep);
}

void CutLargeHoles(TriangleMesh& mesh, std::vector<bool>& far, double largest_hole, HoleCounts& counts) {
  std::vector<Triangle> holes;
  double near_area = 0, all_filled = 0;
  for (const Triangle& t : mesh.triangles) {
    if (IsFar(t, far))
      holes.push_back(t);
    else
      near_area += TriangleArea(mesh, t);
  }
  const Pieces pieces = FindPieces(mesh.vertices.size(), holes);
  std::vector<double> areas(std::size_t(pieces.count));
  for (std::size_t i = 0; i < holes.size(); ++i)
    areas[std::size_t(pieces.of_triangle[i])] += TriangleArea(mesh, holes[i]);
  for (double area : areas) {
    const bool fill = area <= largest_hole * near_area;
    ++(fill ? counts.filled : counts.open);
    if (fill) all_filled += area;
  }
  std::vector<bool> keep;
  std::size_t next = 0;
  for (const Triangle& t : mesh.triangles)
    keep.push_back(!IsFar(t, far) ||
                   areas[std::size_t(pieces.of_triangle[next++])] <= largest_hole * near_area);
  Keep(mesh, far, keep);
  counts.filled_area = near_area > 0 ? all_filled / (near_area + all_filled) : 0;
}

}  // namespace

TriangleMesh FillHoles(const TriangleMesh& input, std::vector<bool>& far, const HoleOptions& options,
                       HoleCounts& counts, Progress& progress) {
  TriangleMesh mesh = input;
  CapHoles(mesh, far);
  DropPieces(mesh, far, options.smallest_piece, counts);
  StretchMembranes(mesh, far, progress);
  progress.Check();
  CutLargeHoles(mesh, far, options.largest_hole, counts);
  DropPieces(mesh, far, options.smallest_piece, counts);
  ComputeVertexNormals(mesh);
  return mesh;
}

}  // namespace polarscan
