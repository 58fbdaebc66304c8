// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/poisson/marching_cubes.h"

#include <bit>
#include <bitset>
#include <cstdint>
#include <numeric>

#include "core/parallel.h"
#include "fusion/mesh_topology.h"

namespace polarscan {
namespace {

// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2). An edge is its axis and its corner of smaller
// coordinates.
constexpr int EdgeOf(int a, int b) {
  const int axis = std::countr_zero(unsigned(a ^ b));
  return 8 * axis + (a < b ? a : b);
}

// Of the corners that are inside, as bits: triangles as edges.
using CellTriangles = std::vector<std::array<int, 3>>;

// On each face, walked around as seen from outside of the cell, a line leads past each run of corners inside,
// from the edge by which the walk comes to it to the edge by which it leaves. These lines join to loops.
CellTriangles TrianglesOf(int inside) {
  constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  std::array<int, 24> next;
  next.fill(-1);
  const auto is_inside = [inside](int corner) { return (inside >> corner & 1) != 0; };
  for (const auto& face : kFaces)
    for (int i = 0; i < 4; ++i) {
      if (is_inside(face[i]) || !is_inside(face[(i + 1) % 4])) continue;
      int j = i + 1;
      while (is_inside(face[(j + 1) % 4])) ++j;
      next[std::size_t(EdgeOf(face[i], face[(i + 1) % 4]))] = EdgeOf(face[j % 4], face[(j + 1) % 4]);
    }
  CellTriangles triangles;
  for (int start = 0; start < 24; ++start) {
    std::vector<int> loop;
    for (int edge = start; next[std::size_t(edge)] >= 0;) {
      loop.push_back(edge);
      edge = std::exchange(next[std::size_t(edge)], -1);
    }
    for (std::size_t i = 2; i < loop.size(); ++i) triangles.push_back({loop[0], loop[i - 1], loop[i]});
  }
  return triangles;
}

// The vertices of the edges that begin at a block's nodes: numbered from `first` in the order of their bits.
struct BlockVertices {
  std::bitset<3 * SparseGrid::kNodes> there;
  std::uint32_t first = 0;
  std::uint32_t Index(int node, int axis) const {
    return first +
           std::uint32_t((there << std::size_t(3 * SparseGrid::kNodes - 1 - (3 * node + axis))).count()) - 1;
  }
};

}  // namespace

TriangleMesh MarchingCubes(const SparseGrid& grid, float level) {
  static const std::vector<CellTriangles> kCells = [] {
    std::vector<CellTriangles> cells;
    for (int inside = 0; inside < 256; ++inside) cells.push_back(TrianglesOf(inside));
    return cells;
  }();
  constexpr int kStep[3] = {1, SparseGrid::kHaloSide, SparseGrid::kHaloSide * SparseGrid::kHaloSide};
  const auto halo_index = [](int node) {
    const auto [x, y, z] = SparseGrid::LocalPlace(node);
    return SparseGrid::HaloIndex(x, y, z);
  };
  const auto count = std::size_t(grid.size());
  std::vector<BlockVertices> vertices(count);
  std::vector<std::vector<Eigen::Vector3d>> positions(count);
  ParallelFor(0, grid.size(), [&](int block) {
    SparseGrid::Halo halo;
    grid.Load(block, halo);
    const SparseGrid::Place place = SparseGrid::PlaceOf(grid.key(block));
    for (int node = 0; node < SparseGrid::kNodes; ++node) {
      const int at = halo_index(node);
      const Eigen::Vector3i corner(SparseGrid::PlaceOfNode(place, node).data());
      for (int axis = 0; axis < 3; ++axis) {
        const float here = halo[std::size_t(at)] - level, there = halo[std::size_t(at + kStep[axis])] - level;
        if ((here > 0) == (there > 0)) continue;
        vertices[std::size_t(block)].there.set(std::size_t(3 * node + axis));
        Eigen::Vector3d position = corner.cast<double>();
        position[axis] += double(here) / (double(here) - double(there));
        positions[std::size_t(block)].push_back(position);
      }
    }
  });
  TriangleMesh mesh;
  for (std::size_t block = 0; block < count; ++block) {
    vertices[block].first = std::uint32_t(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), positions[block].begin(), positions[block].end());
  }
  std::vector<std::vector<Triangle>> triangles(count);
  ParallelFor(0, grid.size(), [&](int block) {
    SparseGrid::Halo halo;
    grid.Load(block, halo);
    const auto& around = grid.Around(block);
    for (int node = 0; node < SparseGrid::kNodes; ++node) {
      const SparseGrid::Place lower = SparseGrid::LocalPlace(node);
      int inside = 0;
      for (int corner = 0; corner < 8; ++corner)
        inside |= int(halo[std::size_t(halo_index(node) + (corner & 1) * kStep[0] +
                                       (corner >> 1 & 1) * kStep[1] + (corner >> 2) * kStep[2])] > level)
                  << corner;
      // The vertex of an edge belongs to the block of the edge's first node.
      const auto vertex = [&](int edge, std::uint32_t& index) {
        int step = 0, local = 0;
        for (int axis = 0, stride = 1, size = 1; axis < 3; ++axis, stride *= 3, size *= SparseGrid::kSide) {
          const int at = lower[std::size_t(axis)] + (edge >> axis & 1);
          step += at / SparseGrid::kSide * stride, local += at % SparseGrid::kSide * size;
        }
        const int owner = around[std::size_t(13 + step)];
        if (owner < 0) return false;
        index = vertices[std::size_t(owner)].Index(local, edge / 8);
        return true;
      };
      for (const auto& edges : kCells[std::size_t(inside)]) {
        Triangle triangle;
        if (vertex(edges[0], triangle[0]) && vertex(edges[1], triangle[1]) && vertex(edges[2], triangle[2]))
          triangles[std::size_t(block)].push_back(triangle);
      }
    }
  });
  for (const auto& part : triangles) mesh.triangles.insert(mesh.triangles.end(), part.begin(), part.end());
  return KeepTriangles(mesh, std::vector<bool>(mesh.triangles.size(), true)).mesh;  // vertices that are used
}

}  // namespace polarscan
