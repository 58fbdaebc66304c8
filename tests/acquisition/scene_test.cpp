// SPDX-License-Identifier: Apache-2.0
// The shapes and scenes of the simulator.
#include "simulation/scene/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "simulation/scene/shapes.h"

namespace polarscan {
namespace {

using Eigen::Vector3d;

TEST(Scene, EveryShapeIsClosedAndOutwardWithinTheUnitSphere) {
  for (const std::string& name : ShapeNames()) {
    TriangleMesh mesh = NamedShape(name);
    Normalize(mesh);
    double volume = 0, radius = 0;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    Vector3d area = Vector3d::Zero();
    for (const auto& t : mesh.triangles) {
      const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
      volume += a.dot(b.cross(c)) / 6;
      area += (b - a).cross(c - a);
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = t[k], to = t[(k + 1) % 3];
        edges[{std::min(from, to), std::max(from, to)}] += from < to ? 1 : -1;
      }
    }
    for (const Vector3d& v : mesh.vertices) radius = std::max(radius, v.norm());
    EXPECT_GT(volume, 0.3) << name;
    EXPECT_LT(area.norm(), 1e-2) << name;  // a closed surface has no area vector
    EXPECT_NEAR(radius, 1, 1e-12) << name;
    if (name == "vase") continue;  // its two poles are tiny open rings
    for (const auto& [edge, sum] : edges) ASSERT_EQ(sum, 0) << name;
  }
}

TEST(Scene, BlocksStandOnTheTableClearOfTheObjectAndFaceOutward) {
  SceneOptions options;
  options.scene = "sphere";
  const Scene scene = MakeScene(options);
  ASSERT_FALSE(scene.blocks.triangles.empty());
  double volume = 0;
  for (const auto& t : scene.blocks.triangles) {
    const Vector3d shift(0, -scene.table_height,
                         0);  // the missing bottoms lie in the plane through the origin
    const Vector3d a = scene.blocks.vertices[t[0]] + shift, b = scene.blocks.vertices[t[1]] + shift,
                   c = scene.blocks.vertices[t[2]] + shift;
    volume += a.dot(b.cross(c)) / 6;
    EXPECT_GT((b - a).cross(c - a).dot(scene.blocks.normals[t[0]]), 0);
  }
  EXPECT_GT(volume, 0.05);
  for (const Vector3d& v : scene.blocks.vertices) {
    EXPECT_GE(v.y(), scene.table_height - 1e-12);
    EXPECT_GT(std::hypot(v.x(), v.z()), 1.0);
    EXPECT_LT(std::max(std::abs(v.x()), std::abs(v.z())), scene.table_half_size);
  }
}

TEST(Scene, ImplicitMeshesLieOnTheirSurfaceWithItsNormals) {
  TriangleMesh mesh = NamedShape("sphere");
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    ASSERT_NEAR(mesh.vertices[i].norm(), 1, 1e-9);
    ASSERT_LT((mesh.normals[i] - mesh.vertices[i].normalized()).norm(), 1e-6);
  }
}

}  // namespace
}  // namespace polarscan
