// SPDX-License-Identifier: Apache-2.0
#include "pipeline/hull_support.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <span>

#include "pipeline/meshing.h"
#include "pipeline/stereo/stereo.h"
#include "pipeline/workspace_views.h"
#include "stereo/dense/load_view.h"
#include "stereo/dense/masks/hull_surface.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {
namespace {

// Six views of the unit sphere, 60 degrees apart.
class HullSupportTest : public testing::Test {
 protected:
  HullSupportTest() {
    Workspace all = LitSphere(folder_.path(), 18, 160, 120);
    workspace_ = all;
    workspace_.views.clear();
    for (std::size_t i = 0; i < all.views.size(); i += 3) workspace_.views.push_back(all.views[i]);
    for (DenseView& view : workspace_.views) {
      view.sources.clear();
      for (int j = 0; j < int(workspace_.views.size()); ++j)
        if (workspace_.views[std::size_t(j)].name != view.name) view.sources.push_back(j);
    }
    WriteWorkspace(workspace_);
  }

  // What lies beyond z = from of the sphere of that radius.
  static std::vector<CloudPoint> Cap(double from, double radius = 1) {
    std::vector<CloudPoint> cloud;
    for (const Eigen::Vector3d& n : SphereMesh(120).vertices)
      if (n.z() > from) cloud.push_back({(radius * n).cast<float>(), n.cast<float>(), {}, 0.2f, 0.9f, 3});
    return cloud;
  }

  static double MeanError(std::span<const CloudPoint> points) {
    double sum = 0;
    for (const CloudPoint& p : points) sum += std::abs(p.position.norm() - 1);
    return sum / double(points.size());
  }

  // Whether a view looks at it from not too far aside.
  bool SeenFrom(const CloudPoint& p) const {
    return std::ranges::any_of(workspace_.views, [&](const DenseView& view) {
      const Eigen::Vector3d to = view.cam_from_world.Center() - p.position.cast<double>();
      return p.normal.cast<double>().dot(to.normalized()) > 0.3;
    });
  }

  bool AddTo(std::vector<CloudPoint>& cloud) {
    HullSupport hull{RefineOptions()};
    return hull.AddTo(cloud, workspace_, said_);
  }

  class Listener : public Progress {
   public:
    void Warn(const std::string& message) override { words += message; }
    std::string words;
  };

  TemporaryFolder folder_;
  Workspace workspace_;
  Listener said_;
};

TEST_F(HullSupportTest, TheHullTouchesTheSphereAndEnclosesIt) {
  const SurfaceViews views = ViewsOfWorkspace(workspace_);
  const std::vector<HullPoint> hull = HullSurface(views.views, views.mask, said_);
  ASSERT_GT(hull.size(), 10'000u);
  double nearest = 10, farthest = 0;
  for (const HullPoint& p : hull) {
    EXPECT_GT(p.normal.dot(p.position.normalized()), 0.3);
    nearest = std::min(nearest, double(p.position.norm()));
    farthest = std::max(farthest, double(p.position.norm()));
  }
  EXPECT_NEAR(nearest, 1, 0.02);  // a pixel is 0.02 wide
  EXPECT_GT(farthest, 1.05);      // corners that no view sees from beside
  EXPECT_LT(farthest, 1.5);
}

TEST_F(HullSupportTest, CompletesWhatTheCloudDoesNotCover) {
  std::vector<CloudPoint> cloud = Cap(0);
  const std::size_t before = cloud.size();
  ASSERT_TRUE(AddTo(cloud));
  const std::span added = std::span(cloud).subspan(before);
  ASSERT_GT(added.size(), 1000u);
  double lowest = 1, covered = 0;
  for (const CloudPoint& p : added) {
    EXPECT_EQ(p.views, 0);
    EXPECT_EQ(p.confidence, 0);
    lowest = std::min(lowest, double(p.position.z()));
    covered += p.position.z() > 0.3 && SeenFrom(p);
  }
  EXPECT_LT(lowest, -0.95);
  EXPECT_LT(covered, 0.01 * double(added.size()));  // where the cloud is, hardly anything is added
  std::vector<CloudPoint> hull;
  for (const HullPoint& p : HullSurface(workspace_.views, ViewsOfWorkspace(workspace_).mask, said_))
    if (p.position.z() < 0) hull.push_back({p.position, p.normal, {}});
  EXPECT_LT(MeanError(added), 0.5 * MeanError(hull));
}

TEST_F(HullSupportTest, LeavesACloudThatCoversTheObjectAsItIs) {
  std::vector<CloudPoint> cloud = Cap(-2);
  const std::size_t before = cloud.size();
  EXPECT_FALSE(AddTo(cloud));
  EXPECT_EQ(cloud.size(), before);
  EXPECT_EQ(said_.words, "");
}

TEST_F(HullSupportTest, BelievesNoMasksThatContradictTheCloudOrAreCutOffOrMissing) {
  std::vector<CloudPoint> larger = Cap(0, 1.3);
  EXPECT_FALSE(AddTo(larger));
  for (int view = 0; view < int(workspace_.views.size()); ++view) {
    Image<std::uint8_t> mask = ReadViewMask(workspace_, view);
    for (int x = 0; x < mask.width(); ++x) mask(x, 0) = 255;
    WritePng(workspace_.MaskPath(view), mask);
  }
  std::vector<CloudPoint> cloud = Cap(0);
  EXPECT_FALSE(AddTo(cloud));
  std::filesystem::remove_all(workspace_.MaskPath(0).parent_path());
  EXPECT_FALSE(AddTo(cloud));
  EXPECT_EQ(said_.words, "");
}

TEST_F(HullSupportTest, AddsTheSamePointsForAnyNumberOfThreads) {
  std::vector<CloudPoint> one = Cap(0), two = Cap(0);
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    ASSERT_TRUE(AddTo(one));
  }
  ASSERT_TRUE(AddTo(two));
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].position, two[i].position);
    EXPECT_EQ(one[i].normal, two[i].normal);
  }
}

TEST_F(HullSupportTest, TheMeshOfHalfACloudIsTheWholeObject) {
  WriteCloud(folder_.path() / "cloud.ply", Cap(0));
  MeshOptions options;
  const MeshSummary with =
      MakeMesh(folder_.path() / "cloud.ply", folder_.path(), folder_.path() / "with.ply", options, said_);
  EXPECT_TRUE(with.closed);
  EXPECT_NEAR(with.hull_area, 0.5, 0.1);
  EXPECT_NE(said_.words.find("known from the masks' outlines and the AoP alone"), std::string::npos);
  EXPECT_LT(with.filled_area, 0.05);
  double low = 0;
  for (const Eigen::Vector3d& v : ReadMesh(folder_.path() / "with.ply").vertices) {
    EXPECT_NEAR(v.norm(), 1, 0.1);
    low = std::min(low, v.z());
  }
  EXPECT_LT(low, -0.95);
  options.hull_support = false;
  const MeshSummary without =
      MakeMesh(folder_.path() / "cloud.ply", folder_.path(), folder_.path() / "without.ply", options, said_);
  EXPECT_EQ(without.hull_area, 0);
}

// Mean distance of the depths from the sphere's; a missing one counts 1.
double DepthError(const Workspace& workspace) {
  double sum = 0;
  int pixels = 0;
  for (int i = 0; i < int(workspace.views.size()); ++i) {
    const Image<float> truth = ExactSphereMaps(workspace.views[std::size_t(i)]).depth,
                       depth = ReadDepthMap(workspace.DepthPath(i, kFinalMaps));
    for (std::size_t k = 0; k < truth.size(); ++k) {
      if (truth.pixels()[k] <= 0) continue;
      const float d = depth.pixels()[k];
      sum += d > 0 ? std::abs(double(d - truth.pixels()[k])) : 1, ++pixels;
    }
  }
  return sum / pixels;
}

TEST_F(HullSupportTest, MapsOfFewViewsAreBetterForIt) {
  StereoOptions options;
  options.filter = false;
  EstimateMaps(folder_.path(), options, said_);
  const double with = DepthError(workspace_);
  options.hull_support = false;
  EstimateMaps(folder_.path(), options, said_);
  const double without = DepthError(workspace_);
  EXPECT_LT(with, 0.5 * without) << without;
  EXPECT_LT(with, 0.02);
}

}  // namespace
}  // namespace polarscan
