// SPDX-License-Identifier: Apache-2.0
#include "simulation/scene/implicit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace polarscan {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

// Values of f at the corners of the cells.
struct Grid {
  Vector3d origin;
  double step = 0;
  Vector3i corners;  // per axis
  std::vector<float> values;

  std::size_t Index(const Vector3i& i) const {
    return (std::size_t(i.z()) * std::size_t(corners.y()) + std::size_t(i.y())) * std::size_t(corners.x()) +
           std::size_t(i.x());
  }
  Vector3d Place(const Vector3i& i) const { return origin + step * i.cast<double>(); }
  bool Inside(const Vector3i& i) const { return values[Index(i)] < 0; }
};

Grid SampleGrid(const Implicit& f, const Eigen::AlignedBox3d& box, int cells, const Progress& progress) {
  Grid grid;
  grid.step = box.sizes().maxCoeff() / cells;
  grid.origin = box.min();
  for (int k = 0; k < 3; ++k) grid.corners[k] = int(std::ceil(box.sizes()[k] / grid.step - 1e-9)) + 1;
  grid.values.resize(std::size_t(grid.corners.x()) * std::size_t(grid.corners.y()) *
                     std::size_t(grid.corners.z()));
  ParallelFor(0, grid.corners.z(), [&](int z) {
    progress.Check();
    for (int y = 0; y < grid.corners.y(); ++y)
      for (int x = 0; x < grid.corners.x();) {
        const double value = f(grid.Place({x, y, z}));
        // Far from the surface only the sign counts.
        const int same = 1 + std::min(int(0.4 * std::abs(value) / grid.step), grid.corners.x() - x - 1);
        std::fill_n(grid.values.begin() + std::ptrdiff_t(grid.Index({x, y, z})), same, float(value));
        x += same;
      }
  });
  return grid;
}

Vector3d Gradient(const Implicit& f, const Vector3d& p, double h) {
  Vector3d g;
  for (int k = 0; k < 3; ++k) {
    const Vector3d e = h * Vector3d::Unit(k);
    g[k] = (f(p + e) - f(p - e)) / (2 * h);
  }
  return g;
}

// Mean of the points where the cell's edges cross the surface; false if none does.
bool CellVertex(const Grid& grid, const Vector3i& cell, Vector3d& vertex) {
  Vector3d sum = Vector3d::Zero();
  int count = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int corner = 0; corner < 8; ++corner) {
      if (corner >> axis & 1) continue;
      const Vector3i a = cell + Vector3i(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
      const Vector3i b = a + Vector3i::Unit(axis);
      const double va = grid.values[grid.Index(a)], vb = grid.values[grid.Index(b)];
      if ((va < 0) == (vb < 0)) continue;
      sum += grid.Place(a) + grid.step * va / (va - vb) * Vector3d::Unit(axis);
      ++count;
    }
  if (count == 0) return false;
  vertex = sum / count;
  return true;
}

// The grid edge from `corner` along `axis` crosses the surface: the four cells around it make a quad,
// outward.
void AddQuad(const Grid& grid, const std::vector<std::uint32_t>& vertex_of_cell, const Vector3i& corner,
             int axis, TriangleMesh& mesh) {
  const Vector3i u = Vector3i::Unit((axis + 1) % 3), v = Vector3i::Unit((axis + 2) % 3);
  if (corner[(axis + 1) % 3] == 0 || corner[(axis + 2) % 3] == 0) return;
  const std::uint32_t a = vertex_of_cell[grid.Index(corner - u - v)],
                      b = vertex_of_cell[grid.Index(corner - v)];
  const std::uint32_t c = vertex_of_cell[grid.Index(corner)], d = vertex_of_cell[grid.Index(corner - u)];
  if (a == kNone || b == kNone || c == kNone || d == kNone) return;
  if (grid.Inside(corner)) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  } else {
    mesh.triangles.push_back({a, c, b});
    mesh.triangles.push_back({a, d, c});
  }
}

// Newton steps along the gradient, none longer than a cell.
Vector3d MoveOntoSurface(const Implicit& f, Vector3d p, double step) {
  for (int i = 0; i < 6; ++i) {
    const Vector3d g = Gradient(f, p, 1e-3 * step);
    const Vector3d move = -f(p) / std::max(g.squaredNorm(), 1e-9) * g;
    p += move * std::min(1.0, 0.3 * step / std::max(move.norm(), 1e-12));
  }
  return p;
}

}  // namespace

TriangleMesh MeshImplicit(const Implicit& f, const Eigen::AlignedBox3d& box, int cells,
                          const Progress& progress) {
  const Grid grid = SampleGrid(f, box, cells, progress);
  TriangleMesh mesh;
  std::vector<std::uint32_t> vertex_of_cell(grid.values.size(), kNone);
  const auto for_each = [&grid](int margin, auto&& visit) {
    for (int z = 0; z + margin < grid.corners.z(); ++z)
      for (int y = 0; y + margin < grid.corners.y(); ++y)
        for (int x = 0; x + margin < grid.corners.x(); ++x) visit(Vector3i(x, y, z));
  };
  for_each(1, [&](const Vector3i& cell) {
    Vector3d vertex;
    if (!CellVertex(grid, cell, vertex)) return;
    vertex_of_cell[grid.Index(cell)] = std::uint32_t(mesh.vertices.size());
    mesh.vertices.push_back(vertex);
  });
  for_each(1, [&](const Vector3i& corner) {
    for (int axis = 0; axis < 3; ++axis)
      if (grid.Inside(corner) != grid.Inside(corner + Vector3i::Unit(axis)))
        AddQuad(grid, vertex_of_cell, corner, axis, mesh);
  });
  mesh.normals.resize(mesh.vertices.size());
  ParallelFor(0, int(mesh.vertices.size()), [&](int i) {
    progress.Check();
    Vector3d& vertex = mesh.vertices[std::size_t(i)];
    vertex = MoveOntoSurface(f, vertex, grid.step);
    mesh.normals[std::size_t(i)] = Gradient(f, vertex, 1e-3 * grid.step).normalized();
  });
  return mesh;
}

}  // namespace polarscan
