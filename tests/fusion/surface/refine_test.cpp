// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/refinement/refine.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>

#include "fusion/surface/refinement/mesh_views.h"
#include "fusion/surface/refinement/normal_fit.h"
#include "fusion/surface/refinement/photometric.h"
#include "fusion/surface/refinement/silhouettes.h"
#include "pipeline/workspace_views.h"
#include "tests/fusion/icosphere.h"
#include "tests/fusion/polar_sphere.h"

namespace polarscan {
namespace {

// The sphere with dents and bumps of this height, some 0.3 long.
TriangleMesh DentedSphere(double height) {
  TriangleMesh mesh = Icosphere(5);
  for (Eigen::Vector3d& v : mesh.vertices)
    v *= 1 + height * std::sin(20 * v.x()) * std::sin(19 * v.y() + 1) * std::sin(21 * v.z() + 2);
  ComputeVertexNormals(mesh);
  return mesh;
}

struct Errors {
  double distance = 0, normal_deg = 0;  // means over the part that the cameras see from the side
};

Errors Compare(const TriangleMesh& mesh) {
  Errors errors;
  double count = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (std::abs(mesh.vertices[i].y()) > 0.6) continue;
    errors.distance += std::abs(mesh.vertices[i].norm() - 1);
    errors.normal_deg += AngleDegrees(mesh.normals[i], mesh.vertices[i]);
    ++count;
  }
  return {errors.distance / count, errors.normal_deg / count};
}

TriangleMesh Refine(const TriangleMesh& mesh, const Workspace& workspace, const RefineOptions& options = {}) {
  Progress progress;
  RefineCounts counts;
  return RefineMesh(mesh, std::vector<bool>(mesh.vertices.size(), false), ViewsOfWorkspace(workspace),
                    options, counts, progress);
}

// A square grid in the plane z = 0, facing +z, 21 x 21 vertices 0.1 apart.
TriangleMesh Grid() {
  constexpr std::uint32_t kSide = 21;
  TriangleMesh mesh;
  for (std::uint32_t y = 0; y < kSide; ++y)
    for (std::uint32_t x = 0; x < kSide; ++x) {
      mesh.vertices.emplace_back(0.1 * x - 1, 0.1 * y - 1, 0);
      const std::uint32_t a = y * kSide + x;
      if (x + 1 == kSide || y + 1 == kSide) continue;
      mesh.triangles.push_back({a, a + 1, a + kSide});
      mesh.triangles.push_back({a + 1, a + kSide + 1, a + kSide});
    }
  ComputeVertexNormals(mesh);
  return mesh;
}

TEST(NormalFitting, AFlatPatchTakesTheSlopeThatItsNormalsAskFor) {
  const TriangleMesh grid = Grid();
  const Eigen::Vector3d asked = Eigen::Vector3d(-0.02, 0.03, 1).normalized();
  const Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity() - asked * asked.transpose();
  NormalFit fit{std::vector<Eigen::Matrix3d>(grid.vertices.size(), matrix),
                std::vector<Pull>(grid.vertices.size(), {0, 1e-9}), 0};
  const Eigen::VectorXd moves = FitMoves(grid, VertexNeighbours(grid.vertices.size(), grid.triangles), fit);
  for (std::size_t i = 0; i < grid.vertices.size(); ++i) {
    const Eigen::Vector3d& v = grid.vertices[i];
    EXPECT_NEAR(moves[Eigen::Index(i)], 0.02 * v.x() - 0.03 * v.y(), 1e-4);
  }
}

TEST(NormalFitting, WithoutAnyNormalsEveryVertexGoesToItsPull) {
  const TriangleMesh grid = Grid();
  NormalFit fit{std::vector<Eigen::Matrix3d>(grid.vertices.size(), Eigen::Matrix3d::Zero()), {}, 0};
  for (const Eigen::Vector3d& v : grid.vertices) fit.pulls.push_back({0.05 * std::sin(9 * v.x()), 1});
  const Eigen::VectorXd moves = FitMoves(grid, VertexNeighbours(grid.vertices.size(), grid.triangles), fit);
  for (std::size_t i = 0; i < fit.pulls.size(); ++i)
    EXPECT_NEAR(moves[Eigen::Index(i)], fit.pulls[i].move, 1e-12);
}

// The mask's radius as the camera sees it: sphere of radius r at distance D has the outline f r / sqrt(D^2 -
// r^2).
TEST(Silhouette, AWiderMaskPullsByTheDifferenceOfTheTwoOutlines) {
  TemporaryFolder folder;
  const Workspace workspace = PolarSphere(folder.path(), 0, 1.03);
  const TriangleMesh sphere = Icosphere(6);
  const RayCaster caster({sphere});
  for (const std::size_t i : {0, 5}) {
    const DenseView& view = workspace.views[i];
    const double square = view.cam_from_world.translation.squaredNorm();
    const double expected = (view.camera.fx + view.camera.fy) / 2 *
                            (1.03 / std::sqrt(square - 1.03 * 1.03) - 1 / std::sqrt(square - 1));
    const auto pulls = OutlinePulls(sphere, caster, view, ReadViewMask(workspace, int(i)), 6);
    ASSERT_GT(pulls.size(), 100u);
    double mean = 0;
    for (const OutlinePull& pull : pulls) mean += pull.distance_px / double(pulls.size());
    EXPECT_GT(expected, 2);
    EXPECT_NEAR(mean, expected, 0.15);
  }
}

TEST(Silhouette, MasksThatAreAllTooWideHardlyInflateTheMesh) {
  TemporaryFolder folder;
  const Workspace workspace = PolarSphere(folder.path(), 0, 1.03);
  const TriangleMesh sphere = Icosphere(5);
  Progress progress;
  std::vector<double> moves;
  for (const Pull& pull : Silhouettes(ViewsOfWorkspace(workspace), 6).Pulls(sphere, progress))
    if (pull.weight > 0) moves.push_back(pull.move);
  ASSERT_GT(moves.size(), 500u);
  std::nth_element(moves.begin(), moves.begin() + std::ptrdiff_t(moves.size() / 2), moves.end());
  EXPECT_LT(moves[moves.size() / 2], 0.006) << "of 0.03";
}

TEST(Silhouette, PointsBesideTheMasksAreOutsideAndThoseThatNoPictureShowsWhereMasksAreWhole) {
  TemporaryFolder folder;
  const Workspace workspace = PolarSphere(folder.path(), 0);
  Progress progress;
  const std::vector<Eigen::Vector3d> points{{0, 0, 0}, {0, 0, 0.99}, {1.1, 0, 0}, {0, 0, -1.1}, {0, 9, 0}};
  EXPECT_EQ(OutsideOfMasks(points, ViewsOfWorkspace(workspace), 2, progress),
            (std::vector<bool>{false, false, true, true, true}));
  for (int i = 0; i < int(workspace.views.size()); ++i) {  // now the object may go on beside the pictures
    Image<std::uint8_t> mask = ReadViewMask(workspace, i);
    mask(0, 0) = 255;
    WritePng(workspace.MaskPath(i), mask);
  }
  EXPECT_EQ(OutsideOfMasks(points, ViewsOfWorkspace(workspace), 2, progress),
            (std::vector<bool>{false, false, true, true, false}));
}

TEST(VertexConstraints, TheStrongestOfMoreThanThereIsRoomForAreKept) {
  constexpr int kViews = int(VertexConstraints::kMost) + 20;
  std::vector<std::vector<bool>> visible(kViews, {true, false});
  visible[0][1] = true;
  VertexConstraints constraints(2, visible);
  const auto angle = [](int view) { return 0.1f * float(view); };
  for (int view = 0; view < kViews; ++view) {
    const Eigen::Vector3f diffuse(std::cos(angle(view)), std::sin(angle(view)), -1.5f);
    constraints.Add(0, {diffuse, -diffuse, float((view * 31) % kViews + 1) / kViews});
  }
  EXPECT_EQ(constraints.CountOf(0), VertexConstraints::kMost);
  EXPECT_EQ(constraints.CountOf(1), 0u);
  const AopTable table = constraints.TableOf(0);
  ASSERT_EQ(table.count, int(VertexConstraints::kMost));
  for (int i = 0; i < table.count; ++i) {
    EXPECT_GT(table.weight[i], 20.5f / kViews) << "the weakest 20";
    EXPECT_NEAR(std::hypot(table.diffuse[0][i], table.diffuse[1][i]), 1, 2e-4);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(table.diffuse[k][i], -table.specular[k][i], 2e-4);
  }
}

SurfaceAppearance AppearanceOf(const TriangleMesh& mesh, const Workspace& workspace) {
  Progress progress;
  SurfaceAppearance appearance{VisibleVertices(mesh, workspace.views, progress), {}};
  for (int i = 0; i < int(workspace.views.size()); ++i) {
    const Image<float> s0 = ReadViewLight(workspace, i).s0;
    Image<std::uint16_t> gray(s0.width(), s0.height());
    for (std::size_t k = 0; k < s0.size(); ++k) gray.pixels()[k] = std::uint16_t(65535 * s0.pixels()[k]);
    appearance.grays.push_back(std::move(gray));
  }
  return appearance;
}

TEST(Photometric, ASphereTooLargeOrTooSmallIsPulledToWhereItsTextureAgrees) {
  TemporaryFolder folder;
  const Workspace workspace = PolarSphere(folder.path(), 0, 1, 0.2);
  for (const double wrong : {-0.015, 0.0, 0.015}) {
    TriangleMesh sphere = Icosphere(6);
    for (Eigen::Vector3d& v : sphere.vertices) v *= 1 + wrong;
    const VertexNeighbours neighbours(sphere.vertices.size(), sphere.triangles);
    Progress progress;
    const auto pulls =
        PhotometricPulls(sphere, neighbours, workspace.views, AppearanceOf(sphere, workspace), progress);
    ASSERT_EQ(pulls.size(), sphere.vertices.size());
    double seen = 0, pulled = 0, off = 0;
    for (std::size_t i = 0; i < pulls.size(); ++i) {
      if (std::abs(sphere.vertices[i].y()) > 0.5) continue;
      ++seen;
      if (pulls[i].weight <= 0) continue;
      ++pulled, off += std::abs(pulls[i].move + wrong);
    }
    EXPECT_GT(pulled / seen, 0.9) << wrong;
    EXPECT_LT(off / pulled, 0.003) << wrong << ": a third of a pixel";
  }
}

TEST(Photometric, WhatHasNoTextureIsNotPulled) {
  TemporaryFolder folder;
  const Workspace workspace = PolarSphere(folder.path(), 0);
  const TriangleMesh sphere = Icosphere(5);
  const VertexNeighbours neighbours(sphere.vertices.size(), sphere.triangles);
  Progress progress;
  for (const Pull& pull :
       PhotometricPulls(sphere, neighbours, workspace.views, AppearanceOf(sphere, workspace), progress))
    ASSERT_EQ(pull.weight, 0);
}

TEST(Refinement, TextureAloneLevelsADentedSphere) {
  TemporaryFolder folder;
  Workspace workspace = PolarSphere(folder.path(), 0.005, 1, 0.2);
  workspace.polarized = false;
  TriangleMesh dented = Icosphere(6);
  for (Eigen::Vector3d& v : dented.vertices) v *= 1 + 0.02 * std::sin(9 * v.x()) * std::sin(8 * v.z() + 1);
  ComputeVertexNormals(dented);
  RefineOptions options;
  options.masks = false;
  const Errors before = Compare(dented), after = Compare(Refine(dented, workspace, options));
  EXPECT_LT(after.distance, 0.5 * before.distance) << before.distance;
  EXPECT_LT(after.normal_deg, 0.7 * before.normal_deg) << before.normal_deg;
}

TEST(Refinement, RecoversADentedSphereFromItsPolarization) {
  TemporaryFolder folder;
  const Workspace workspace = PolarSphere(folder.path(), 0.005);
  const TriangleMesh dented = DentedSphere(0.01);
  const Errors before = Compare(dented);
  RefineOptions options;
  options.masks = false;
  const Errors polarization = Compare(Refine(dented, workspace, options));
  EXPECT_LT(polarization.normal_deg, 0.25 * before.normal_deg) << before.normal_deg;
  EXPECT_LT(polarization.distance, 0.4 * before.distance) << before.distance;
  const Errors both = Compare(Refine(dented, workspace));
  EXPECT_LT(both.normal_deg, 0.25 * before.normal_deg);
  EXPECT_LT(both.distance, 0.4 * before.distance);
}

TEST(Refinement, OutlinesAloneStraightenABuckledSphereAndSmoothADentedOne) {
  TemporaryFolder folder;
  Workspace workspace = PolarSphere(folder.path(), 0.005);
  workspace.polarized = false;
  TriangleMesh buckled = Icosphere(5);
  for (Eigen::Vector3d& v : buckled.vertices) v *= 1 + 0.02 * std::sin(3 * std::atan2(v.z(), v.x()));
  ComputeVertexNormals(buckled);
  EXPECT_LT(Compare(Refine(buckled, workspace)).distance, 0.6 * Compare(buckled).distance);
  const TriangleMesh dented = DentedSphere(0.01);
  const Errors before = Compare(dented), after = Compare(Refine(dented, workspace));
  EXPECT_LT(after.normal_deg, 0.8 * before.normal_deg) << before.normal_deg;
  EXPECT_LT(after.distance, before.distance);
  RefineOptions nothing;
  nothing.masks = false;
  EXPECT_FALSE(CanRefine(ViewsOfWorkspace(workspace), nothing));
  EXPECT_TRUE(CanRefine(ViewsOfWorkspace(workspace), {}));
}

TEST(Refinement, LeavesAnExactSphereWhereItIs) {
  TemporaryFolder folder;
  const Workspace workspace = PolarSphere(folder.path(), 0.005);
  const TriangleMesh sphere = Icosphere(5);
  const Errors errors = Compare(Refine(sphere, workspace));
  EXPECT_LT(errors.distance, 0.002) << "a fifth of a pixel";
  EXPECT_LT(errors.normal_deg, 0.6);
}

TEST(Refinement, OneAndTwoThreadsGiveTheSameMesh) {
  TemporaryFolder folder;
  const Workspace workspace = PolarSphere(folder.path(), 0.005);
  const TriangleMesh dented = DentedSphere(0.01);
  std::vector<TriangleMesh> results;
  for (std::size_t threads : {1, 2}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(Refine(dented, workspace));
  }
  EXPECT_TRUE(results[0].vertices == results[1].vertices);
  EXPECT_FALSE(results[0].vertices == dented.vertices);
}

}  // namespace
}  // namespace polarscan
