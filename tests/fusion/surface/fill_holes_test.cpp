// SPDX-License-Identifier: Apache-2.0
// A surface as a graph: its borders, the holes that are filled or cut out, membranes over them, fewer triangles.
#include "fusion/surface/fill_holes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fusion/mesh_topology.h"
#include "fusion/surface/membranes.h"
#include "fusion/surface/simplify.h"
#include "tests/fusion/icosphere.h"
#include "tests/fusion/mesh_checks.h"

namespace polarscan {
namespace {

TEST(Topology, AnIcosphereIsClosedAndEverythingHasSixNeighboursButTheCorners) {
  const TriangleMesh sphere = Icosphere(3);
  EXPECT_TRUE(IsClosed(sphere));
  const VertexNeighbours neighbours(sphere.vertices.size(), sphere.triangles);
  for (std::size_t v = 0; v < sphere.vertices.size(); ++v) {
    EXPECT_EQ(neighbours.Of(v).size(), v < 6 ? 4u : 6u);
    ASSERT_EQ(neighbours.TrianglesOf(v).size(), v < 6 ? 4u : 6u);
    EXPECT_TRUE(std::ranges::is_sorted(neighbours.TrianglesOf(v)));
    for (std::uint32_t t : neighbours.TrianglesOf(v))
      EXPECT_EQ(std::ranges::count(sphere.triangles[t], std::uint32_t(v)), 1);
  }
}

TEST(Topology, AMissingTriangleLeavesALoopThatFillsIt) {
  TriangleMesh sphere = Icosphere(2);
  const Triangle gone = sphere.triangles[10];
  sphere.triangles.erase(sphere.triangles.begin() + 10);
  auto loops = BorderLoops(sphere.triangles);
  ASSERT_EQ(loops.size(), 1u);
  ASSERT_EQ(loops[0].size(), 3u);
  sphere.triangles.push_back({loops[0][0], loops[0][1], loops[0][2]});
  EXPECT_TRUE(IsClosed(sphere));
  Triangle filled = sphere.triangles.back();
  std::rotate(filled.begin(), std::find(filled.begin(), filled.end(), gone[0]), filled.end());
  EXPECT_EQ(filled, gone) << "the other way round";
}

// A harmonic function takes its extremes on the rim.
TEST(Closing, AFarCapBecomesAMembraneBetweenTheHighestAndLowestOfItsRim) {
  const TriangleMesh sphere = Icosphere(5);
  std::vector<bool> far;
  double highest_near = -1;
  for (const Eigen::Vector3d& v : sphere.vertices) {
    far.push_back(v.z() > 0.8);
    if (!far.back()) highest_near = std::max(highest_near, v.z());
  }
  HoleCounts counts;
  Progress silent;
  const TriangleMesh closed = FillHoles(sphere, far, {}, counts, silent);
  EXPECT_TRUE(IsClosed(closed));
  EXPECT_EQ(counts.filled, 1);
  EXPECT_EQ(counts.open, 0);
  ASSERT_EQ(closed.vertices.size(), far.size());
  for (std::size_t v = 0; v < far.size(); ++v) {
    EXPECT_LE(closed.vertices[v].z(), highest_near + 1e-6);
    EXPECT_TRUE(!far[v] || closed.vertices[v].z() > 0.74);
  }
  // The disc of radius 0.6 over the surface of the sphere below z = 0.8.
  EXPECT_NEAR(counts.filled_area, 0.36 / (0.36 + 2 * 1.8), 0.01);
}

TEST(Closing, AGapLargerThanAskedForIsCutAndLeavesABorder) {
  const TriangleMesh sphere = Icosphere(4);
  std::vector<bool> far;
  for (const Eigen::Vector3d& v : sphere.vertices) far.push_back(v.z() > 0);
  HoleCounts counts;
  Progress silent;
  const TriangleMesh half = FillHoles(sphere, far, {}, counts, silent);
  EXPECT_EQ(counts.open, 1);
  EXPECT_EQ(BorderLoops(half.triangles).size(), 1u);
  for (const Eigen::Vector3d& v : half.vertices) EXPECT_LE(v.z(), 1e-9);
}

// A square of side * side vertices; all but those of its rim are free and far from their places.
struct Square {
  TriangleMesh mesh;
  std::vector<bool> free;
};

Square LooseSquare(std::uint32_t side) {
  Square square;
  for (std::uint32_t y = 0; y < side; ++y)
    for (std::uint32_t x = 0; x < side; ++x) {
      const bool rim = x == 0 || y == 0 || x + 1 == side || y + 1 == side;
      square.mesh.vertices.emplace_back(x, y, rim ? 0.5 * x - 0.25 * y : 100 * std::sin(0.01 * x));
      square.free.push_back(!rim);
      if (x == 0 || y == 0) continue;
      const std::uint32_t i = y * side + x;
      square.mesh.triangles.push_back({i - side - 1, i - side, i - 1});
      square.mesh.triangles.push_back({i - side, i, i - 1});
    }
  return square;
}

TEST(Membranes, ALargeOneOverAPlaneRimIsThatPlane) {
  Square square = LooseSquare(700);
  Progress silent;
  StretchMembranes(square.mesh, square.free, silent);
  double worst = 0;
  for (const Eigen::Vector3d& v : square.mesh.vertices)
    worst = std::max(worst, std::abs(v.z() - (0.5 * v.x() - 0.25 * v.y())));
  EXPECT_LT(worst, 1e-3);
}

// A sum of the numbers of its neighbours exceeds 2^31, which a minimum-degree ordering did not survive.
TEST(Membranes, AVertexInTheMiddleOfAHugeHoleAmongAMillionIsTheMeanOfItsNeighbours) {
  Square square = LooseSquare(1050);
  const auto middle = std::uint32_t(square.mesh.vertices.size());
  square.mesh.vertices.emplace_back(0, 0, 1000);
  square.free.push_back(true);
  for (std::uint32_t i = middle - 9000; i < middle - 2000; ++i)
    square.mesh.triangles.push_back({i, i + 1, middle});
  Progress silent;
  StretchMembranes(square.mesh, square.free, silent);
  const VertexNeighbours neighbours(square.mesh.vertices.size(), square.mesh.triangles);
  double worst = 0;
  for (std::size_t v = 0; v < square.free.size(); ++v) {
    if (!square.free[v]) continue;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::uint32_t other : neighbours.Of(v)) sum += square.mesh.vertices[other];
    worst = std::max(worst, (sum / double(neighbours.Of(v).size()) - square.mesh.vertices[v]).norm());
  }
  EXPECT_LT(worst, 1e-3);
}

TEST(Membranes, StretchingThemCanBeCancelled) {
  struct Impatient : Progress {
    void Advance(std::size_t) override { Cancel(); }
  } progress;
  Square square = LooseSquare(100);
  EXPECT_THROW(StretchMembranes(square.mesh, square.free, progress), Cancelled);
}

TEST(Closing, SmallPiecesAndPiecesWithoutPointsGo) {
  TriangleMesh mesh = Icosphere(4);
  std::vector<bool> far(mesh.vertices.size(), false);
  const TriangleMesh piece = Icosphere(1);
  for (const auto& [size, is_far] : {std::pair{0.05, false}, {2.0, true}, {0.5, false}}) {
    const auto first = std::uint32_t(mesh.vertices.size());
    for (const Eigen::Vector3d& v : piece.vertices) {
      mesh.vertices.emplace_back(size * v + Eigen::Vector3d(5 * double(first), 0, 0));
      far.push_back(is_far);
    }
    for (const Triangle& t : piece.triangles)
      mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  HoleCounts counts;
  Progress silent;
  const TriangleMesh kept = FillHoles(mesh, far, {}, counts, silent);
  EXPECT_EQ(counts.pieces, 2);
  EXPECT_EQ(FindPieces(kept.vertices.size(), kept.triangles).count, 2);
}

TEST(Simplification, AClosedSphereStaysClosedAndRound) {
  const TriangleMesh simple = Simplify(Icosphere(5), 1000);
  EXPECT_LE(simple.triangles.size(), 1000u);
  EXPECT_GT(simple.triangles.size(), 900u);
  EXPECT_TRUE(IsClosed(simple));
  EXPECT_LT(FarthestFromSphere(simple), 1e-6) << "its vertices are some of the old ones";
}

}  // namespace
}  // namespace polarscan
