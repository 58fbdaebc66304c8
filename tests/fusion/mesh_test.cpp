// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "fusion/mesh_files.h"
#include "fusion/surface/poisson/poisson.h"
#include "pipeline/meshing.h"
#include "tests/fusion/mesh_checks.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// `count` points spread evenly over the unit sphere, exact normals; those above `highest` z are missing.
std::vector<CloudPoint> SphereCloud(int count, double highest = 2) {
  std::vector<CloudPoint> cloud;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - 2 * (i + 0.5) / count, around = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - z * z);
    const Eigen::Vector3f p(float(r * std::cos(around)), float(r * std::sin(around)), float(z));
    if (z <= highest) cloud.push_back({p, p, SphereColour(p.cast<double>()), 0.25f, 0.75f, 5});
  }
  return cloud;
}

// A cloud and a workspace without masks or polarization in a folder of its own.
struct MeshScan {
  explicit MeshScan(const std::vector<CloudPoint>& cloud) {
    Workspace workspace = SphereWorkspace(folder.path() / "dense", 3);
    workspace.polarized = false;
    WriteWorkspace(workspace);
    WriteCloud(Cloud(), cloud);
  }
  fs::path Cloud() const { return folder.path() / "cloud.ply"; }
  fs::path Mesh() const { return folder.path() / "mesh.ply"; }
  MeshSummary Make(const MeshOptions& options = {}) {
    Progress progress;
    return MakeMesh(Cloud(), folder.path() / "dense", Mesh(), options, progress);
  }
  std::string WhatMakeThrows(const MeshOptions& options = {}) {
    try {
      Make(options);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  TemporaryFolder folder;
};

TEST(Meshing, APoissonDepthHoldsTwoPointsACell) {
  const std::vector<CloudPoint> cloud = SphereCloud(20000);
  const int depth = PoissonDepth(cloud);
  const double cell = PoissonCell(cloud, depth);
  EXPECT_NEAR(cell, 2.2 / std::pow(2, depth), 1e-3);
  // A sphere crosses about 1.5 times as many cells as fit its area.
  const double cells = 1.5 * 4 * std::numbers::pi / (cell * cell);
  EXPECT_GT(20000 / cells, 1.8);
  EXPECT_LT(20000 / cells, 9);
}

TEST(Meshing, ASphereCloudGivesAClosedMeshWithinAThirteenthOfACell) {
  MeshScan scan(SphereCloud(5000));
  const MeshSummary summary = scan.Make();
  const TriangleMesh mesh = ReadMesh(scan.Mesh());
  EXPECT_TRUE(summary.closed);
  EXPECT_TRUE(IsClosed(mesh));
  EXPECT_EQ(mesh.triangles.size(), summary.faces);
  EXPECT_EQ(2 * mesh.vertices.size(), 4 + mesh.triangles.size()) << "Euler's formula for a sphere";
  EXPECT_LT(FarthestFromSphere(mesh), summary.cell / 13);
  for (const CloudPoint& v : ReadSurfaceMesh(scan.Mesh()).vertices) {
    const Eigen::Vector3d n = v.position.cast<double>().normalized();
    EXPECT_GT(v.normal.cast<double>().dot(n), std::cos(summary.cell));
    EXPECT_NEAR(v.colour.r, SphereColour(n).r, 12);
    EXPECT_NEAR(v.confidence, 0.75, 1e-5);
  }
}

TEST(Meshing, AHoleIsClosedByAFlatMembraneWithoutConfidence) {
  MeshScan scan(SphereCloud(5000, 0.8));
  const MeshSummary summary = scan.Make();
  EXPECT_TRUE(summary.closed);
  EXPECT_EQ(summary.holes_filled, 1);
  std::size_t unseen = 0;
  for (const CloudPoint& v : ReadSurfaceMesh(scan.Mesh()).vertices) {
    EXPECT_LT(v.position.z(), 0.8 + 2 * summary.cell);
    if (v.position.head<2>().norm() < 0.4 && v.position.z() > 0) {
      EXPECT_EQ(v.confidence, 0);
      ++unseen;
    }
  }
  EXPECT_GT(unseen, 10u);
}

TEST(Meshing, HalfASphereIsCutAtItsRimUnlessAskedToBeWatertight) {
  MeshScan scan(SphereCloud(5000, 0));
  MeshSummary summary = scan.Make();
  EXPECT_FALSE(summary.closed);
  for (const Eigen::Vector3d& v : ReadMesh(scan.Mesh()).vertices) EXPECT_LT(v.z(), 2 * summary.cell);
  MeshOptions options;
  options.largest_hole = 1000;
  summary = scan.Make(options);
  EXPECT_TRUE(summary.closed);
}

TEST(Meshing, FacesLimitsTheTrianglesOfAClosedMesh) {
  MeshScan scan(SphereCloud(5000));
  MeshOptions options;
  options.faces = 800;
  const MeshSummary summary = scan.Make(options);
  EXPECT_LE(summary.faces, 800u);
  EXPECT_TRUE(summary.closed);
}

TEST(Meshing, TwoRunsAndTwoThreadsGiveTheSameBytes) {
  MeshScan scan(SphereCloud(5000, 0.9));
  scan.Make();
  const std::string first = ReadFile(scan.Mesh());
  for (std::size_t threads : {1, 2}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    scan.Make();
    EXPECT_TRUE(ReadFile(scan.Mesh()) == first) << threads << " threads";
  }
}

TEST(Meshing, WhatCannotBecomeAMeshIsSaidWithWhatToDo) {
  EXPECT_NE(MeshScan(SphereCloud(50)).WhatMakeThrows().find("50 of 50 points"), std::string::npos);

  MeshScan unsure(SphereCloud(1000));
  MeshOptions options;
  options.min_confidence = 0.9;
  EXPECT_NE(unsure.WhatMakeThrows(options).find("--mesh-min-confidence"), std::string::npos);

  options = {};
  options.depth = 3;
  EXPECT_NE(MeshScan(SphereCloud(1000)).WhatMakeThrows(options).find("--mesh-depth 3"), std::string::npos);

  MeshScan gone(SphereCloud(1000));
  fs::remove(gone.Cloud());
  EXPECT_NE(gone.WhatMakeThrows().find("polarscan fuse"), std::string::npos);

  MeshScan bare(SphereCloud(1000));
  WriteFileAtomically(bare.Cloud(),
                      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                      "property float z\nend_header\n0 0 0\n");
  EXPECT_NE(bare.WhatMakeThrows().find("no nx"), std::string::npos);
}

}  // namespace
}  // namespace polarscan
