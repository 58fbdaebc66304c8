// SPDX-License-Identifier: Apache-2.0
#include "stereo/refined_poses.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/error.h"
#include "core/files/files.h"
#include "pipeline/stereo/corrections/pose_refinement.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

Rigid Shifted(double x) { return {Eigen::Matrix3d::Identity(), {x, 0, 4}}; }

// A workspace of two views, a and b, at x = 1 and 2.
class RefinedPosesFile : public testing::Test {
 protected:
  RefinedPosesFile() : folder_(fs::path(testing::TempDir()) / ("poses." + std::to_string(::getpid()))) {
    fs::remove_all(folder_);
    CreateFolder(folder_ / "stereo");
    workspace_.folder = folder_;
    workspace_.views = {{"a", {64, 48, 60, 60, 32, 24}, Shifted(1), 2, 6, {1}},
                        {"b", {64, 48, 60, 60, 32, 24}, Shifted(2), 2, 6, {0}}};
    WriteWorkspace(workspace_);
  }
  ~RefinedPosesFile() override { fs::remove_all(folder_); }

  static double X(const Workspace& workspace, std::size_t view) {
    return workspace.views[view].cam_from_world.translation.x();
  }

  const fs::path folder_;
  Workspace workspace_;
  RefinedPoses refined_{"7", {{"a", Shifted(1.1)}}, {{{"a", Shifted(1.2)}}, {{"b", Shifted(2.3)}}}, 0.6, 5,
                        "a"};
};

TEST_F(RefinedPosesFile, EveryReaderOfTheWorkspaceGetsTheLastFit) {
  WriteRefinedPoses(folder_, refined_);
  const Workspace read = ReadWorkspace(folder_);
  EXPECT_EQ(X(read, 0), 1.2);
  EXPECT_EQ(X(read, 1), 2.3);
  EXPECT_EQ(X(ReadWorkspaceAsGiven(folder_), 0), 1);
  EXPECT_EQ(X(WithPoses(workspace_, refined_, 0), 0), 1.1);
  EXPECT_EQ(X(WithPoses(workspace_, refined_, 1), 1), 2);
  RemoveRefinedPoses(folder_);
  EXPECT_EQ(X(ReadWorkspace(folder_), 0), 1);
}

TEST_F(RefinedPosesFile, PosesOfOtherViewsOrInputsDoNotCount) {
  WriteRefinedPoses(folder_, refined_);
  EXPECT_EQ(KnownPoses(workspace_, "7").fits.size(), 2u);
  EXPECT_FALSE(KnownPoses(workspace_, "8").Any());
  workspace_.views[1].depth_max = 7;
  WriteWorkspace(workspace_);
  EXPECT_FALSE(ReadRefinedPoses(folder_));
  EXPECT_EQ(X(ReadWorkspace(folder_), 0), 1);
}

TEST_F(RefinedPosesFile, DamageIsNamed) {
  WriteRefinedPoses(folder_, refined_);
  const std::string text = ReadFile(folder_ / "stereo/poses.json");
  for (const std::string& damaged : {text.substr(0, text.size() / 2), std::string("{}")}) {
    WriteFileAtomically(folder_ / "stereo/poses.json", damaged);
    try {
      ReadWorkspace(folder_);
      FAIL() << "no error";
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find("poses.json"), std::string::npos) << e.what();
    }
  }
}

TEST_F(RefinedPosesFile, StereoBeginsAnewOnceWhereAViewWasFarOff) {
  RefinedPoses refined{"7", {}, {{{"a", Shifted(1.5)}}}, 0.6, 2, "a"};
  EXPECT_FALSE(BeginsAnew(workspace_, refined));  // 2 px: its maps are of use
  refined.worst_px = 20;
  const std::uint64_t before = WithStart(7, refined);
  EXPECT_TRUE(BeginsAnew(workspace_, refined));
  EXPECT_NE(WithStart(7, refined), before);
  EXPECT_EQ(X(WithPoses(workspace_, *ReadRefinedPoses(folder_), 0), 0), 1.5);
  refined.fits.push_back({{"a", Shifted(1.6)}});
  EXPECT_FALSE(BeginsAnew(workspace_, refined));
}

TEST_F(RefinedPosesFile, IsSaidInWords) {
  EXPECT_EQ(RefinedPosesWords({}), "");
  EXPECT_NE(RefinedPosesWords(refined_).find(
                "it lay 0.6 px off in the pictures in the median, 5.0 px in that of a"),
            std::string::npos);
  refined_.median_px = 0.1;
  EXPECT_NE(RefinedPosesWords(refined_).find("the pose of a did not fit"), std::string::npos);
}

}  // namespace
}  // namespace polarscan
