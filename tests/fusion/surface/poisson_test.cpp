// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/poisson/poisson.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "core/error.h"
#include "core/random.h"
#include "fusion/mesh_topology.h"
#include "fusion/surface/poisson/marching_cubes.h"
#include "fusion/surface/poisson/sparse_grid.h"

namespace polarscan {
namespace {

// All nodes of 2^depth a side hold f(x, y, z).
template <class F>
SparseGrid FullGrid(int depth, F&& f) {
  std::vector<std::uint64_t> blocks;
  const int count = (1 << depth) / SparseGrid::kSide;
  for (int i = 0; i < count * count * count; ++i)
    blocks.push_back(SparseGrid::Key({i % count, i / count % count, i / (count * count)}));
  SparseGrid grid(depth, blocks, nullptr);
  for (int block = 0; block < grid.size(); ++block) {
    const auto [bx, by, bz] = SparseGrid::PlaceOf(grid.key(block));
    for (int z = 0; z < SparseGrid::kSide; ++z)
      for (int y = 0; y < SparseGrid::kSide; ++y)
        for (int x = 0; x < SparseGrid::kSide; ++x)
          grid.Values(block)[SparseGrid::LocalIndex(x, y, z)] =
              float(f(SparseGrid::kSide * bx + x, SparseGrid::kSide * by + y, SparseGrid::kSide * bz + z));
  }
  return grid;
}

double Volume(const TriangleMesh& mesh) {
  double volume = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    volume += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c])) / 6;
  return volume;
}

// By how often an edge is passed one way more than the other.
int Unbalanced(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> passes;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      passes[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  return int(std::ranges::count_if(passes, [](const auto& edge) { return edge.second != 0; }));
}

TEST(SparseGrid, NodesThatAreNotActiveHaveTheCoarserGridsValues) {
  const SparseGrid coarse = FullGrid(4, [](int x, int y, int z) { return x + 10 * y + 100 * z; });
  SparseGrid fine(5, {SparseGrid::Key({1, 2, 3})}, &coarse);
  const auto expected = [](int x, int y, int z) { return 0.5f * float(x + 10 * y + 100 * z); };
  EXPECT_EQ(fine.At(5, 9, 14), expected(5, 9, 14)) << "its values begin there, too";
  fine.Values(0)[SparseGrid::LocalIndex(1, 1, 2)] = -1;
  EXPECT_EQ(fine.At(5, 9, 14), -1);
  EXPECT_EQ(fine.At(8, 9, 14), expected(8, 9, 14));
  EXPECT_EQ(fine.At(-3, 0, 0), 0) << "beyond the cube the nearest node counts";
  SparseGrid::Halo halo;
  fine.Load(0, halo);
  for (int z = -1; z <= SparseGrid::kSide; ++z)
    for (int y = -1; y <= SparseGrid::kSide; ++y)
      for (int x = -1; x <= SparseGrid::kSide; ++x)
        EXPECT_EQ(halo[std::size_t(SparseGrid::HaloIndex(x, y, z))], fine.At(4 + x, 8 + y, 12 + z));
}

TEST(MarchingCubes, ABallsSurfaceLiesOnItAndFacesOutward) {
  const Eigen::Vector3d centre(15.3, 14.9, 16.2);
  const SparseGrid grid =
      FullGrid(5, [&](int x, int y, int z) { return 3 - (Eigen::Vector3d(x, y, z) - centre).norm(); });
  const TriangleMesh mesh = MarchingCubes(grid, -7);
  EXPECT_TRUE(BorderLoops(mesh.triangles).empty());
  EXPECT_EQ(2 * mesh.vertices.size(), 4 + mesh.triangles.size()) << "Euler's formula";
  for (const Eigen::Vector3d& v : mesh.vertices) EXPECT_NEAR((v - centre).norm(), 10, 0.02);
  EXPECT_NEAR(Volume(mesh), 4 / 3. * std::numbers::pi * 1000, 40);
}

// Random signs hold all 256 cells, those with ambiguous faces among them.
TEST(MarchingCubes, RandomValuesGiveAClosedSurface) {
  Random random(1, 0);
  const SparseGrid grid = FullGrid(4, [&](int x, int y, int z) {
    return std::min({x, y, z}) == 0 || std::max({x, y, z}) == 15 ? -1 : random.Uniform() - 0.5;
  });
  const TriangleMesh mesh = MarchingCubes(grid, 0);
  EXPECT_GT(mesh.triangles.size(), 5000u);
  EXPECT_EQ(Unbalanced(mesh), 0);
  EXPECT_GT(Volume(mesh), 0);
}

std::vector<CloudPoint> Points(int count, const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& place,
                               const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& normal) {
  std::vector<CloudPoint> cloud;
  Random random(2, 0);
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d direction =
        Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
    CloudPoint point{};
    point.position = place(direction).cast<float>();
    point.normal = normal(direction).normalized().cast<float>();
    cloud.push_back(point);
  }
  return cloud;
}

// A squeezed sphere, its points with it: their density differs by place.
TEST(Poisson, AnEllipsoidOfUnevenDensityIsClosedAndWithinAFractionOfACell) {
  const Eigen::Vector3d axes(1, 0.8, 0.3);
  Progress progress;
  const std::vector<CloudPoint> cloud = Points(
      60000, [&](const Eigen::Vector3d& d) { return Eigen::Vector3d(d.cwiseProduct(axes)); },
      [&](const Eigen::Vector3d& d) { return Eigen::Vector3d(d.cwiseQuotient(axes)); });
  const int depth = 6;
  const TriangleMesh mesh = PoissonSurface(cloud, depth, progress);
  EXPECT_TRUE(BorderLoops(mesh.triangles).empty());
  EXPECT_EQ(FindPieces(mesh.vertices.size(), mesh.triangles).count, 1);
  const double cell = PoissonCell(cloud, depth);
  double sum = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) {
    const Eigen::Vector3d unit =
        v.cwiseQuotient(axes);  // |unit| - 1 over its gradient's length: the distance
    const double distance = (unit.norm() - 1) / unit.normalized().cwiseQuotient(axes).norm();
    EXPECT_LT(std::abs(distance), 0.3 * cell) << v.transpose();
    sum += std::abs(distance);
  }
  EXPECT_LT(sum / double(mesh.vertices.size()), 0.03 * cell);
  EXPECT_NEAR(Volume(mesh), 4 / 3. * std::numbers::pi * axes.prod(), 0.01);
}

// Normals that differ by 20 degrees, positions by a third of a cell.
TEST(Poisson, NoiseIsAveraged) {
  Random random(3, 0);
  const double cell = 2.2 / 32;
  const std::vector<CloudPoint> cloud = Points(
      60000, [&](const Eigen::Vector3d& d) { return Eigen::Vector3d(d * (1 + cell / 3 * random.Normal())); },
      [&](const Eigen::Vector3d& d) {
        return Eigen::Vector3d(d + 0.2 * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()));
      });
  Progress progress;
  const TriangleMesh mesh = PoissonSurface(cloud, 5, progress);
  EXPECT_TRUE(BorderLoops(mesh.triangles).empty());
  double sum = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) sum += std::abs(v.norm() - 1);
  EXPECT_LT(sum / double(mesh.vertices.size()), cell / 10);
}

// Longer in x: the cube has room for the balloon above the hole.
TEST(Poisson, AHoleIsClosed) {
  const Eigen::Vector3d axes(1.5, 1, 1);
  std::vector<CloudPoint> cloud = Points(
      60000, [&](const Eigen::Vector3d& d) { return Eigen::Vector3d(d.cwiseProduct(axes)); },
      [&](const Eigen::Vector3d& d) { return Eigen::Vector3d(d.cwiseQuotient(axes)); });
  std::erase_if(cloud, [](const CloudPoint& p) { return p.position.z() > 0.8; });
  Progress progress;
  const TriangleMesh mesh = PoissonSurface(cloud, 7, progress);
  EXPECT_TRUE(BorderLoops(mesh.triangles).empty());
  double highest = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) highest = std::max(highest, v.z());
  EXPECT_GT(highest, 0.75);
  EXPECT_LT(highest, 1.1);
}

TEST(Poisson, OnePlaceIsNoSurface) {
  const std::vector<CloudPoint> cloud(500);
  Progress progress;
  EXPECT_THROW(PoissonSurface(cloud, 5, progress), NothingFound);
}

TEST(Poisson, WhatWouldNotFitInMemoryIsRefusedWithWhatToDo) {
  Random random(4, 0);
  std::vector<CloudPoint> cloud(1'000'000);
  for (CloudPoint& point : cloud) {
    point.position = Eigen::Vector3f(random.Uniform(), random.Uniform(), random.Uniform());
    point.normal = Eigen::Vector3f::UnitX();
  }
  Progress progress;
  try {
    PoissonSurface(cloud, 12, progress);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("--mesh-depth"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace polarscan
