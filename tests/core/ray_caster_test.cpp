// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/mesh.h"
#include "core/random.h"

namespace polarscan {
namespace {

using Eigen::Vector3d;

// A sphere of longitude/latitude triangles with exact normals.
TriangleMesh Sphere(const Vector3d& center, double radius, int rings) {
  TriangleMesh mesh;
  const int columns = 2 * rings;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j < columns; ++j) {
      const double polar = std::numbers::pi * i / rings, turn = std::numbers::pi * 2 * j / columns;
      const Vector3d n(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar));
      mesh.vertices.push_back(center + radius * n);
      mesh.normals.push_back(n);
    }
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < columns; ++j) {
      const auto id = [&](int a, int b) { return std::uint32_t(a * columns + b % columns); };
      mesh.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      mesh.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  return mesh;
}

TriangleMesh Floor(double z) {
  TriangleMesh mesh;
  mesh.vertices = {{-50, -50, z}, {50, -50, z}, {50, 50, z}, {-50, 50, z}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  ComputeVertexNormals(mesh);
  return mesh;
}

Vector3d Direction(Random& random) {
  return Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
}

TEST(RayCaster, HitsAFineSphereWhereTheFormulaSays) {
  const Vector3d center(1, -2, 3);
  const RayCaster caster({Sphere(center, 2, 400)});
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    const Vector3d origin = center + 10 * Direction(random), target = center + 1.5 * Direction(random);
    const Vector3d direction = (target - origin) * 0.3;
    const Vector3d oc = origin - center;
    const double a = direction.squaredNorm(), b = oc.dot(direction), c = oc.squaredNorm() - 4;
    const double distance = (-b - std::sqrt(b * b - a * c)) / a;
    const RayCaster::Hit hit = caster.Cast(origin, direction);
    ASSERT_EQ(hit.mesh, 0);
    const Vector3d truth = origin + distance * direction;
    EXPECT_LT((origin + hit.distance * direction - truth).norm(), 1e-3);
    EXPECT_LT((caster.Normal(hit) - (truth - center) / 2).norm(), 1e-3);
  }
}

TEST(RayCaster, PlaneDistancesAreExactToDoublePrecisionEvenFarFromTheOrigin) {
  for (double shift : {0.0, 1e5}) {
    TriangleMesh floor = Floor(-1);
    for (Vector3d& v : floor.vertices) v.x() += shift;
    const RayCaster caster({floor});
    Random random(2);
    for (int i = 0; i < 200; ++i) {
      Vector3d direction = Direction(random);
      direction.z() = -std::abs(direction.z()) - 0.1;
      const Vector3d origin(shift + random.Uniform(), random.Uniform(), 1 + random.Uniform());
      const RayCaster::Hit hit = caster.Cast(origin, direction);
      ASSERT_EQ(hit.mesh, 0);
      EXPECT_NEAR(hit.distance, (-1 - origin.z()) / direction.z(), 1e-10 * (1 + shift));
    }
  }
}

TEST(RayCaster, BarycentricWeightsGiveTheHitPoint) {
  const RayCaster caster({Sphere({0, 0, 0}, 1, 20)});
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Vector3d origin = 4 * Direction(random), direction = 0.5 * Direction(random) - origin;
    const RayCaster::Hit hit = caster.Cast(origin, direction);
    ASSERT_EQ(hit.mesh, 0);
    const TriangleMesh& mesh = caster.meshes()[0];
    const auto& t = mesh.triangles[std::size_t(hit.triangle)];
    const Vector3d point =
        (1 - hit.u - hit.v) * mesh.vertices[t[0]] + hit.u * mesh.vertices[t[1]] + hit.v * mesh.vertices[t[2]];
    EXPECT_LT((origin + hit.distance * direction - point).norm(), 1e-12);
    EXPECT_GE(std::min({hit.u, hit.v, 1 - hit.u - hit.v}), -1e-5);
  }
}

TEST(RayCaster, TellsMeshesApartAndSeesThroughNothing) {
  const RayCaster caster({Floor(0), Sphere({0, 0, 2}, 1, 50), {}});
  EXPECT_EQ(caster.Cast({0, 0, 9}, {0, 0, -1}).mesh, 1);
  EXPECT_EQ(caster.Cast({3, 0, 9}, {0, 0, -1}).mesh, 0);
  EXPECT_EQ(caster.Cast({3, 0, 9}, {0, 0, 1}).mesh, -1);
  EXPECT_TRUE(caster.Occluded({0.1, 0, 0}, {0, 0, 1}));        // under the sphere
  EXPECT_FALSE(caster.Occluded({0.1, 0, 0}, {0, 0, 1}, 0.5));  // the sphere begins at 1
  EXPECT_FALSE(caster.Occluded({3, 0, 0}, {0, 0, 1}));         // a surface does not hide itself
}

TEST(RayCaster, AnEmptySceneIsNeverHit) {
  const RayCaster caster({});
  EXPECT_EQ(caster.Cast({0, 0, 0}, {0, 0, 1}).mesh, -1);
  EXPECT_FALSE(caster.Occluded({0, 0, 0}, {0, 0, 1}));
}

}  // namespace
}  // namespace polarscan
