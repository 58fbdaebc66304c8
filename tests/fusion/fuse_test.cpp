// SPDX-License-Identifier: Apache-2.0
#include "fusion/cloud/fuse.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "core/formats/ply.h"
#include "core/random.h"
#include "fusion/cloud/cloud.h"
#include "fusion/cloud/overlap.h"
#include "tests/fusion/listener.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

struct Cloud {
  std::vector<Eigen::Vector3d> positions, normals;
  PlyElement vertex;
};

Cloud ReadCloud(const fs::path& path) {
  Cloud cloud;
  cloud.vertex = ReadPly(path).at("vertex");
  auto& c = cloud.vertex.columns;
  for (std::size_t i = 0; i < cloud.vertex.count; ++i) {
    cloud.positions.emplace_back(c["x"][i], c["y"][i], c["z"][i]);
    cloud.normals.emplace_back(c["nx"][i], c["ny"][i], c["nz"][i]);
  }
  return cloud;
}

double RmsOffSphere(const std::vector<Eigen::Vector3d>& points) {
  double sum = 0;
  for (const Eigen::Vector3d& p : points) sum += std::pow(p.norm() - 1, 2) / double(points.size());
  return std::sqrt(sum);
}

// Depths off by a normal error of this standard deviation.
void AddDepthNoise(int view, SphereMaps& maps, double sigma) {
  Random random(7, std::uint64_t(view));
  for (float& depth : maps.depth.pixels())
    if (depth > 0) depth += float(sigma * random.Normal());
}

TEST(Fusion, ExactMapsOfASphereFuseOntoTheSphere) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 6);
  WriteSphere(workspace);
  Progress progress;
  const CloudSummary summary = FuseCloud(folder.path(), folder.path() / "cloud.ply", {}, progress);
  Cloud cloud = ReadCloud(folder.path() / "cloud.ply");
  ASSERT_EQ(cloud.positions.size(), summary.points);
  EXPECT_GT(summary.points, 3000u);
  EXPECT_EQ(summary.views, 6);
  EXPECT_EQ(summary.maps, "geometric");
  EXPECT_LT(RmsOffSphere(cloud.positions), 3e-4);  // a pixel is 0.016 wide there
  auto& columns = cloud.vertex.columns;
  for (std::size_t i = 0; i < cloud.positions.size(); ++i) {
    const Eigen::Vector3d n = cloud.positions[i].normalized();
    EXPECT_GT(cloud.normals[i].dot(n), std::cos(0.03));
    EXPECT_NEAR(columns["red"][i], SphereColour(n).r, 4);
    EXPECT_NEAR(columns["blue"][i], SphereColour(n).b, 4);
    EXPECT_NEAR(columns["dop"][i], kSphereDop, 1e-5);
    EXPECT_GE(columns["views"][i], 3);
    EXPECT_LE(columns["views"][i], 6);
    EXPECT_GT(columns["confidence"][i], 0);
    EXPECT_LT(columns["confidence"][i], 1);
  }
}

TEST(Fusion, EveryPixelWithADepthEndsInExactlyOneCount) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 4);
  std::size_t with_depth = 0;
  WriteSphere(workspace, [&](int view, SphereMaps& maps) {
    AddDepthNoise(view, maps, 0.02);
    maps.normal(80, 60).setZero();
    for (float depth : maps.depth.pixels()) with_depth += depth > 0;
  });
  Progress progress;
  const FusionCounts c = FuseCloud(workspace, folder.path() / "cloud.ply", {}, progress).counts;
  EXPECT_EQ(c.with_depth, with_depth);
  EXPECT_EQ(c.without_normal, 4u);
  EXPECT_EQ(c.masked + c.without_normal + c.absorbed + c.too_few_views + c.contradicted + c.points,
            c.with_depth);
}

TEST(Fusion, AveragingViewsReducesNoise) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 9);
  const double sigma = 0.004;
  WriteSphere(workspace, [&](int view, SphereMaps& maps) { AddDepthNoise(view, maps, sigma); });
  Progress progress;
  FuseCloud(workspace, folder.path() / "cloud.ply", {}, progress);
  EXPECT_LT(RmsOffSphere(ReadCloud(folder.path() / "cloud.ply").positions), 0.7 * sigma);
}

TEST(Fusion, StraysOfOneViewMakeNoPoints) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 6);
  WriteSphere(workspace, [](int view, SphereMaps& maps) {
    Random random(3, std::uint64_t(view));
    for (float& depth : maps.depth.pixels())
      if (depth > 0 && random.Uniform() < 0.3) depth *= random.Uniform(0.7f, 1.3f);
  });
  Progress progress;
  FuseCloud(workspace, folder.path() / "cloud.ply", {}, progress);
  const auto positions = ReadCloud(folder.path() / "cloud.ply").positions;
  std::size_t strays = 0;
  for (const Eigen::Vector3d& p : positions) strays += std::abs(p.norm() - 1) > 0.05;
  EXPECT_GT(positions.size(), 3000u);
  EXPECT_LT(double(strays) / double(positions.size()), 0.001);
}

TEST(Fusion, OneAndTwoThreadsAndAnyMemoryGiveTheSameBytes) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 6);
  WriteSphere(workspace, [](int view, SphereMaps& maps) { AddDepthNoise(view, maps, 0.01); });
  Progress progress;
  const auto fuse = [&](std::size_t threads, double memory_gb) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    FusionOptions options;
    options.memory_gb = memory_gb;
    FuseCloud(workspace, folder.path() / "cloud.ply", options, progress);
    return ReadFile(folder.path() / "cloud.ply");
  };
  const std::string one = fuse(1, 4);
  EXPECT_EQ(one, fuse(2, 4));
  EXPECT_EQ(one, fuse(2, 0));
}

long PeakKb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

TEST(Fusion, ViewsInAnyOrderAreWalkedFromNeighbourToNeighbour) {
  Workspace workspace;
  for (int i = 0; i < 12; ++i) {  // a ring; one steps over every five of its places
    const double angle = i * 5 % 12 * std::numbers::pi / 6 + 1e-3 * i;
    workspace.views.emplace_back().cam_from_world =
        LookAtOrigin({4 * std::sin(angle), 1, 4 * std::cos(angle)});
  }
  const std::vector<int> order = WalkingOrder(workspace);
  EXPECT_EQ(std::set<int>(order.begin(), order.end()).size(), 12u);
  EXPECT_EQ(order.front(), 0);
  const auto place = [&](std::size_t i) { return order[i] * 5 % 12; };
  for (std::size_t i = 1; i < order.size(); ++i)
    EXPECT_EQ(std::min((place(i) - place(i - 1) + 12) % 12, (place(i - 1) - place(i) + 12) % 12), 1);
}

// 120 views take 53 MB as maps and the points 20 MB; the limit leaves room for the 13 views that a pixel
// asks.
TEST(Fusion, MemoryIsBoundedByItsLimitAndNotByTheNumberOfViews) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 120);  // more than six times around
  WriteSphere(workspace);
  FusionOptions options;
  options.memory_gb = 0.006;
  options.check_views = 12;
  Progress progress;
  const long before = PeakKb();
  const CloudSummary summary = FuseCloud(workspace, folder.path() / "cloud.ply", options, progress);
  EXPECT_GT(summary.counts.with_depth, 1'000'000u);
  EXPECT_LT(PeakKb() - before, 25'000);
}

TEST(Fusion, TheCloudBeginsWithTheStandardNineProperties) {
  TemporaryFolder folder;
  WriteCloud(folder.path() / "c.ply", {{{1, 2, 3}, {0, 0, 1}, {10, 20, 30}, 0.25f, 0.5f, 300}}, "hello");
  const std::string bytes = ReadFile(folder.path() / "c.ply");
  const std::string header =
      "ply\nformat binary_little_endian 1.0\ncomment hello\nelement vertex 1\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property float dop\nproperty float confidence\nproperty ushort views\nend_header\n";
  ASSERT_EQ(bytes.substr(0, header.size()), header);
  const std::vector<float> floats = {1, 2, 3, 0, 0, 1, 0.25f, 0.5f};
  const auto* raw = reinterpret_cast<const char*>(floats.data());
  std::string expected(raw, 24);
  expected.append("\x0a\x14\x1e").append(raw + 24, 8).append("\x2c\x01");
  EXPECT_EQ(bytes.substr(header.size()), expected);
}

TEST(Fusion, MasksLeavePixelsOut) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 5);
  WriteSphere(workspace);
  Image<std::uint8_t> upper(160, 120);
  for (int y = 0; y < 58; ++y)
    for (int x = 0; x < 160; ++x) upper(x, y) = 255;
  for (int i = 0; i < 5; ++i) WritePng(workspace.MaskPath(i), upper);
  Progress progress;
  FusionOptions options;
  const CloudSummary masked = FuseCloud(workspace, folder.path() / "masked.ply", options, progress);
  options.masks = false;
  const CloudSummary whole = FuseCloud(workspace, folder.path() / "whole.ply", options, progress);
  EXPECT_EQ(whole.counts.masked, 0u);
  EXPECT_NEAR(double(masked.counts.masked) / double(masked.counts.with_depth), 0.5, 0.03);
  EXPECT_LT(masked.points, 0.65 * double(whole.points));
  for (const Eigen::Vector3d& p : ReadCloud(folder.path() / "masked.ply").positions) {
    const Eigen::Vector3d camera = workspace.views[0].cam_from_world * p;
    EXPECT_LT(workspace.views[0].camera.Project(camera).y(),
              85);  // all views are masked below 58; they differ in tilt
  }
}

TEST(Fusion, StopsWhenCancelled) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 4);
  WriteSphere(workspace);
  Progress progress;
  progress.Cancel();
  EXPECT_THROW(FuseCloud(workspace, folder.path() / "cloud.ply", {}, progress), Cancelled);
  EXPECT_FALSE(fs::exists(folder.path() / "cloud.ply"));
}

// The workspace with each view a second time, from the same place but for what poses err by.
Workspace Twice(const Workspace& once) {
  Workspace twice = once;
  twice.views.clear();
  for (DenseView view : once.views) {
    view.sources.clear();
    twice.views.push_back(view);
    view.name += "b";
    view.cam_from_world.translation += Eigen::Vector3d(2e-3, -1e-3, 2e-3);
    twice.views.push_back(view);
  }
  return twice;
}

TEST(Fusion, AgreementIsCountedByPlacesAndNotByPictures) {
  for (const int places : {2, 5}) {
    TemporaryFolder folder;
    const Workspace workspace = Twice(SphereWorkspace(folder.path(), places));
    WriteSphere(workspace);
    Listener listener;
    FuseCloud(workspace, folder.path() / "cloud.ply", {}, listener);
    Cloud cloud = ReadCloud(folder.path() / "cloud.ply");
    for (const double views : cloud.vertex.columns["views"]) {
      ASSERT_LE(views, places);
      ASSERT_GE(views, std::min(places, 3));
    }
    EXPECT_EQ(listener.warnings.find("only 2 views") != std::string::npos, places == 2) << listener.warnings;
  }
}

TEST(Fusion, ASecondWitnessFromThePlaceOfTheFirstSecuresNothing) {
  TemporaryFolder folder;
  const Workspace workspace = Twice(SphereWorkspace(folder.path(), 3));
  // Views 0 and 1 stand at one place and agree on a depth that no other view sees.
  WriteSphere(workspace, [](int view, SphereMaps& maps) {
    if (view < 2)
      for (float& depth : maps.depth.pixels()) depth *= 0.8f;
  });
  FusionOptions options;
  options.min_views = 2;
  Listener listener;
  FuseCloud(workspace, folder.path() / "cloud.ply", options, listener);
  for (const Eigen::Vector3d& p : ReadCloud(folder.path() / "cloud.ply").positions)
    ASSERT_NEAR(p.norm(), 1, 0.02);
}

TEST(Fusion, ALocalFrameIsSaidInTheCloudAndBesideItAndChangesNoPoint) {
  TemporaryFolder folder;
  Workspace workspace = SphereWorkspace(folder.path(), 4);
  WriteSphere(workspace);
  Listener listener;
  const fs::path cloud = folder.path() / "cloud.ply";
  FuseCloud(workspace, cloud, {}, listener);
  const auto before = ReadCloud(cloud).positions;
  EXPECT_FALSE(fs::exists(folder.path() / "offset.txt"));
  EXPECT_EQ(ReadPlyOffset(cloud), Eigen::Vector3d(0, 0, 0));
  workspace.offset = {500000.25, 5400000, -300};
  WriteWorkspace(workspace);
  FuseCloud(folder.path(), cloud, {}, listener);
  EXPECT_EQ(ReadFile(folder.path() / "offset.txt"), "500000.25 5400000 -300\n");
  EXPECT_EQ(ReadPlyOffset(cloud), workspace.offset);
  EXPECT_TRUE(ReadCloud(cloud).positions == before);
}

}  // namespace
}  // namespace polarscan
