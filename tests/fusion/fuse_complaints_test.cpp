// SPDX-License-Identifier: Apache-2.0
// Fusion of too little: maps that are missing, damaged or do not agree, and what is said of them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "fusion/cloud/fuse.h"
#include "tests/fusion/listener.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

std::string WhatFusionThrows(const Workspace& workspace, const FusionOptions& options = {}) {
  Progress progress;
  try {
    FuseCloud(workspace, workspace.folder / "cloud.ply", options, progress);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Fusion, NothingConsistentIsExplainedWithCounts) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 4);
  WriteSphere(workspace, [](int view, SphereMaps& maps) {
    for (float& depth : maps.depth.pixels()) depth *= float(1 + 0.25 * view);
  });
  FusionOptions options;
  options.min_views = 4;
  const std::string what = WhatFusionThrows(workspace, options);
  EXPECT_NE(what.find("nothing to fuse"), std::string::npos) << what;
  EXPECT_NE(what.find("fewer than 4 views agree"), std::string::npos) << what;
  EXPECT_NE(what.find("another depth"), std::string::npos) << what;
  EXPECT_NE(what.find("--fusion-depth"), std::string::npos) << what;
  EXPECT_FALSE(fs::exists(folder.path() / "cloud.ply"));
}

TEST(Fusion, WhatToChangeFollowsFromWhatRemovedMost) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 6);
  WriteSphere(workspace, [](int view, SphereMaps& maps) {  // turned to and fro about the line of sight
    const Eigen::AngleAxisf turn(view % 2 ? 1.2f : -1.2f, Eigen::Vector3f::UnitX());
    for (Eigen::Vector3f& normal : maps.normal.pixels()) normal = turn * normal;
  });
  FusionOptions options;
  options.normal_deg = 1, options.min_views = 6;
  EXPECT_NE(WhatFusionThrows(workspace, options).find("raise --fusion-normal"), std::string::npos)
      << WhatFusionThrows(workspace, options);
  options.normal_deg = 180, options.relative_depth = 1e-6;
  EXPECT_NE(WhatFusionThrows(workspace, options).find("raise --fusion-depth"), std::string::npos)
      << WhatFusionThrows(workspace, options);
}

TEST(Fusion, ADamagedViewIsNamedAndLeftOutAsIfItWereNotThere) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 6);
  WriteSphere(workspace);
  const fs::path damaged = workspace.NormalPath(2, kFinalMaps);
  fs::resize_file(damaged, fs::file_size(damaged) - 100);
  FusionOptions options;
  options.check_views = 3;  // the damaged view takes nobody's place
  Listener listener;
  const CloudSummary summary = FuseCloud(workspace, folder.path() / "cloud.ply", options, listener);
  EXPECT_EQ(summary.damaged, std::vector<std::string>{"v102"});
  EXPECT_EQ(summary.views, 5);
  EXPECT_NE(listener.warnings.find(damaged.string()), std::string::npos) << listener.warnings;
  fs::remove(workspace.DepthPath(2, kFinalMaps));
  FuseCloud(workspace, folder.path() / "without.ply", options, listener);
  EXPECT_EQ(ReadFile(folder.path() / "cloud.ply"), ReadFile(folder.path() / "without.ply"));
}

TEST(Fusion, NoSoundMapAtAllIsAnErrorThatLeavesNoCloud) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 3);
  WriteSphere(workspace);
  for (int i = 0; i < 3; ++i) fs::resize_file(workspace.DepthPath(i, kFinalMaps), 30);
  EXPECT_NE(WhatFusionThrows(workspace).find("nothing to fuse"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder.path() / "cloud.ply"));
}

TEST(Fusion, NoMapsAtAllSendsTheUserToStereo) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 4);
  WriteWorkspace(workspace);
  EXPECT_NE(WhatFusionThrows(workspace).find("polarscan stereo"), std::string::npos);
}

TEST(Fusion, ViewsWithoutMapsAreNamedAndLeftOut) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 5);
  WriteSphere(workspace);
  fs::remove(workspace.DepthPath(3, kFinalMaps));
  Listener listener;
  const CloudSummary summary = FuseCloud(workspace, folder.path() / "cloud.ply", {}, listener);
  EXPECT_EQ(summary.views, 4);
  EXPECT_NE(listener.warnings.find("v103"), std::string::npos);
}

TEST(Fusion, PhotometricMapsServeWhereThereAreNoGeometricOnes) {
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 4);
  WriteSphere(
      workspace, [](int, SphereMaps&) {}, kPhotometricMaps);
  Progress progress;
  EXPECT_EQ(FuseCloud(workspace, folder.path() / "cloud.ply", {}, progress).maps, "photometric");
}

TEST(Fusion, ViewsTooFarApartAreSaidWithTheirAngleAndNeighboursAreNot) {
  TemporaryFolder folder;
  Workspace workspace = SphereWorkspace(folder.path(), 18);
  WriteSphere(workspace);
  Listener listener;
  const auto words = [&] {
    return FewAgree(ToJson(FuseCloud(workspace, folder.path() / "cloud.ply", {}, listener)), 3);
  };
  EXPECT_EQ(words(), "");
  for (int view = 17; view >= 0; --view)
    if (view % 3 != 0) workspace.views.erase(workspace.views.begin() + view);
  for (DenseView& view : workspace.views) view.sources.clear();
  const std::string few = words();
  EXPECT_NE(few.find("Take more in between"), std::string::npos) << few;
  const double angle = NeighbourAngle(workspace.views);
  EXPECT_NEAR(angle, 62, 4);
  EXPECT_NE(few.find(fmt::format("{:.0f} degrees apart", angle)), std::string::npos) << few;
}

TEST(Fusion, FewDepthsOfLargePicturesAreSaidWithTheOptionThatMakesThemSmaller) {
  const auto words = [](double pixels) {
    return FewDepths({{"views", 2},
                      {"neighbour_deg", 20},
                      {"pixels", {{"inside", pixels}, {"with_depth", 0.01 * pixels}}}});
  };
  EXPECT_NE(words(4e7).find("--max-image-size"), std::string::npos) << words(4e7);
  EXPECT_NE(words(4e6).find("only 1 %"), std::string::npos) << words(4e6);
  EXPECT_EQ(words(4e6).find("--max-image-size"), std::string::npos) << words(4e6);
}

TEST(Fusion, FewDepthsInsideOfTheMasksAreSaidWhereViewsAreNear) {
  TemporaryFolder folder;
  Workspace workspace = SphereWorkspace(folder.path(), 18);
  WriteSphere(workspace);
  WriteSphereMasks(workspace);
  const auto words = [&](bool masks) {
    FusionOptions options;
    options.masks = masks;
    Listener listener;
    return FewDepths(ToJson(FuseCloud(workspace, folder.path() / "cloud.ply", options, listener)));
  };
  EXPECT_EQ(words(true), "");
  WriteSphere(workspace, [](int, SphereMaps& maps) {  // what a filter leaves of wrong depths
    for (int y = 0; y < maps.depth.height(); ++y)
      for (int x = 0; x < maps.depth.width(); ++x)
        if (y % 8 > 1) maps.depth(x, y) = 0;
  });
  EXPECT_NE(words(true).find("% of the pixels inside of the masks have a depth"), std::string::npos);
  EXPECT_EQ(words(false), "") << "masks that are not used tell nothing";
}

}  // namespace
}  // namespace polarscan
