// SPDX-License-Identifier: Apache-2.0
// What an evaluation measures with: the similarity between two frames, and distances to a surface.
#include "stereo/sfm/alignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "core/random.h"
#include "fusion/surface/surface.h"
#include "tests/fusion/similarity.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {
namespace {

Eigen::Vector3d RandomPoint(Random& random) { return {random.Normal(), random.Normal(), random.Normal()}; }

TEST(Similarity, IsRecoveredFromItsPairs) {
  const Similarity truth = SomeSimilarity();
  Random random(1);
  std::vector<Eigen::Vector3d> from, to;
  for (int i = 0; i < 5; ++i) {
    from.push_back(RandomPoint(random));
    to.push_back(truth * from.back());
  }
  const Similarity found = EstimateSimilarity(from, to);
  EXPECT_NEAR(found.scale, truth.scale, 1e-12);
  EXPECT_LT((found.rotation - truth.rotation).norm(), 1e-12);
  EXPECT_LT((found.translation - truth.translation).norm(), 1e-11);
}

TEST(Similarity, IsARotationAlsoForPointsInAPlane) {
  const Similarity truth = SomeSimilarity();
  std::vector<Eigen::Vector3d> from = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 2, 0}}, to;
  for (const Eigen::Vector3d& p : from) to.push_back(truth * p);
  EXPECT_LT((EstimateSimilarity(from, to).rotation - truth.rotation).norm(), 1e-9);
}

TEST(Similarity, IsRefusedForPointsOnALineOrTooFew) {
  const std::vector<Eigen::Vector3d> line = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}};
  EXPECT_THROW(EstimateSimilarity(line, line), Error);
  EXPECT_THROW(EstimateSimilarity({{0, 0, 0}, {1, 0, 0}}, {{0, 0, 0}, {1, 0, 0}}), Error);
}

TEST(Alignment, MovesCamerasOntoTheirTruePosesAndReportsTheResidual) {
  const Similarity truth_from_scan = SomeSimilarity();
  const Workspace scan = SphereWorkspace("unused", 6);
  std::vector<NamedPose> truth = Poses(scan);
  for (NamedPose& pose : truth) pose.cam_from_world = truth_from_scan(pose.cam_from_world);
  // A point looks the same from the moved camera, but for the scale.
  const Eigen::Vector3d p(0.3, 0.2, -0.4), before = scan.views[2].cam_from_world * p,
                                           after = truth[2].cam_from_world * (truth_from_scan * p);
  EXPECT_LT((after - truth_from_scan.scale * before).norm(), 1e-12);

  truth.push_back({"unregistered", {}});
  EXPECT_LT(AlignCameras(Poses(scan), truth).errors.max, 1e-11);
  EXPECT_LT(AlignCameras(Poses(scan), truth).errors.rotation_deg, 1e-5);
  EXPECT_EQ(AlignCameras(Poses(scan), truth).errors.cameras, 6);

  truth[4].cam_from_world.translation.z() += 0.5;
  const Alignment bent = AlignCameras(Poses(scan), truth);
  EXPECT_EQ(bent.errors.worst, "v104");
  EXPECT_GT(bent.errors.max, 0.1);
  EXPECT_LT(bent.errors.max, 0.5);
}

TEST(Alignment, NeedsThreeCamerasOfTheSameName) {
  std::vector<NamedPose> scan = Poses(SphereWorkspace("unused", 6)), truth = scan;
  for (std::size_t i = 2; i < truth.size(); ++i) truth[i].name += "x";
  EXPECT_THROW(AlignCameras(scan, truth), Error);
}

TEST(Surface, DistanceToATriangleIsThatOfTheNearestOfManyOfItsPoints) {
  Random random(5);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d a = RandomPoint(random), b = RandomPoint(random), c = RandomPoint(random),
                          p = 2 * RandomPoint(random);
    double nearest = 1e9;
    for (int u = 0; u <= 200; ++u)
      for (int v = 0; u + v <= 200; ++v)
        nearest = std::min(nearest, (a + u / 200. * (b - a) + v / 200. * (c - a) - p).norm());
    const double distance = TriangleDistance(p, a, b, c);
    EXPECT_LE(distance, nearest + 1e-12);
    EXPECT_GE(distance, nearest - 0.03);
  }
}

TEST(Surface, DistanceToAMeshIsTheLeastOverItsTriangles) {
  TriangleMesh mesh = SphereMesh(12);
  for (Eigen::Vector3d& v : mesh.vertices)
    v += Eigen::Vector3d(100, 0, 0);  // far away, where floats are coarse
  const RayCaster surface({mesh});
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p = Eigen::Vector3d(100, 0, 0) + 0.8 * RandomPoint(random);
    double least = 1e9;
    for (const auto& t : mesh.triangles)
      least =
          std::min(least, TriangleDistance(p, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]));
    EXPECT_NEAR(surface.Distance(p), least, 1e-9);
  }
}

TEST(Surface, SamplesLieOnTheMeshUniformByArea) {
  const TriangleMesh mesh = SphereMesh(100);
  EXPECT_NEAR(SurfaceArea(mesh), 4 * std::numbers::pi, 0.003);
  const auto samples = SampleSurface(mesh, 40000, 1);
  double above = 0;
  for (const SurfaceSample& s : samples) {
    EXPECT_NEAR(s.position.norm(), 1, 6e-4);
    EXPECT_GT(s.normal.dot(s.position), 0.99);
    above += s.position.z() > 0.5;  // a quarter of the sphere, by Archimedes
  }
  EXPECT_NEAR(above / double(samples.size()), 0.25, 0.01);
}

}  // namespace
}  // namespace polarscan
