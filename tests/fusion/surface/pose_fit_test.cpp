// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/refinement/pose_fit.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "pipeline/workspace_views.h"
#include "tests/fusion/icosphere.h"
#include "tests/fusion/polar_sphere.h"

namespace polarscan {
namespace {

// The unit sphere with a texture, seen by 18 cameras.
class PoseFits : public testing::Test {
 protected:
  // Root mean square, px, of how far a view's pose shows the sphere's near side from where it truly is.
  double ErrorPx(const Rigid& pose, std::size_t view) const {
    const DenseView& v = true_.views[view];
    double sum = 0, count = 0;
    for (const Eigen::Vector3d& p : sphere_.vertices) {
      if (p.dot(v.cam_from_world.Center()) < 2) continue;
      sum += (v.camera.Project(pose * p) - v.camera.Project(v.cam_from_world * p)).squaredNorm(), ++count;
    }
    return std::sqrt(sum / count);
  }
  // Every view's pose off by a rotation and a shift, which move the sphere by about so many pixels.
  Workspace WithErrors(double px) const {
    Workspace workspace = true_;
    for (std::size_t i = 0; i < workspace.views.size(); ++i) {
      Random random(5, i);
      DenseView& view = workspace.views[i];
      const double angle = px / view.camera.fx;
      const Eigen::Vector3d axis(random.Normal(), random.Normal(), random.Normal());
      const Eigen::Vector3d shift(random.Normal(), random.Normal(), random.Normal());
      view.cam_from_world = Rigid{Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix(),
                                  angle * view.cam_from_world.translation.norm() * shift.normalized()} *
                            view.cam_from_world;
    }
    return workspace;
  }
  std::vector<PoseFit> Fit(const Workspace& workspace, bool masks = true) const {
    Progress progress;
    return FitPoses(sphere_, ViewsOfWorkspace(workspace), masks, progress);
  }

  const TemporaryFolder folder_;
  const TriangleMesh sphere_ = Icosphere(6);
  const Workspace true_ = PolarSphere(folder_.path(), 0.001, 1, 0.15);
};

TEST_F(PoseFits, PosesThatAreOffByAPixelOrTwoAreFound) {
  const Workspace off = WithErrors(1);
  Workspace better = off;
  for (int round = 0; round < 3; ++round) {  // the others' errors blur the mean look at first
    const std::vector<PoseFit> fits = Fit(better);
    for (std::size_t i = 0; i < fits.size(); ++i) {
      ASSERT_TRUE(fits[i].fitted) << i;
      better.views[i].cam_from_world = fits[i].cam_from_world;
    }
  }
  double before = 0, after = 0;
  for (std::size_t i = 0; i < off.views.size(); ++i) {
    before += ErrorPx(off.views[i].cam_from_world, i) / double(off.views.size());
    after += ErrorPx(better.views[i].cam_from_world, i) / double(off.views.size());
  }
  EXPECT_GT(before, 1);
  EXPECT_LT(after, 0.5 * before);  // all together may turn about the sphere's centre
}

TEST_F(PoseFits, RightPosesStayWhereTheyAre) {
  for (const bool masks : {true, false})
    for (const PoseFit& fit : Fit(true_, masks)) {
      EXPECT_TRUE(fit.fitted);
      EXPECT_LT(fit.moved_px, 0.1) << masks;
    }
}

TEST_F(PoseFits, OneViewThatIsFarOffIsBroughtBackByItsOutline) {
  Workspace off = true_;
  Rigid& pose = off.views[3].cam_from_world;
  pose = Rigid{Eigen::Matrix3d::Identity(), {0.12, -0.05, 0}} * pose;  // 12 px and 5 px
  const std::vector<PoseFit> fits = Fit(off);
  EXPECT_LT(ErrorPx(fits[3].cam_from_world, 3), 0.3);
  EXPECT_NEAR(fits[3].moved_px, ErrorPx(pose, 3), 1);
  EXPECT_LT(ErrorPx(fits[8].cam_from_world, 8), 0.1);
}

TEST_F(PoseFits, WhatCannotBeToldStays) {
  // No texture: the outline of a sphere does not tell how the camera is turned about it.
  const TemporaryFolder folder;
  const Workspace plain = PolarSphere(folder.path(), 0.001);
  Progress progress;
  for (const bool masks : {true, false}) {
    const auto fits = FitPoses(sphere_, ViewsOfWorkspace(plain), masks, progress);
    for (std::size_t i = 0; i < fits.size(); ++i) {
      EXPECT_FALSE(fits[i].fitted);
      EXPECT_EQ(fits[i].cam_from_world.translation, plain.views[i].cam_from_world.translation);
    }
  }
}

TEST_F(PoseFits, AreTheSameForAnyNumberOfThreads) {
  const Workspace off = WithErrors(1);
  const std::vector<PoseFit> many = Fit(off);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const std::vector<PoseFit> single = Fit(off);
  for (std::size_t i = 0; i < many.size(); ++i) {
    EXPECT_EQ(many[i].cam_from_world.rotation, single[i].cam_from_world.rotation);
    EXPECT_EQ(many[i].cam_from_world.translation, single[i].cam_from_world.translation);
  }
}

}  // namespace
}  // namespace polarscan
