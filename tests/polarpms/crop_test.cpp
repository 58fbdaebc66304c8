// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/crop.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/formats/image_io.h"
#include "pipeline/stereo/stage_inputs.h"

namespace polarscan {
namespace {

constexpr int kPictureWidth = 640, kPictureHeight = 480;

// One view whose object is a rectangle; options.levels = 1.
class Crop : public testing::Test {
 protected:
  Crop() {
    workspace_.views.push_back({"v", {kPictureWidth, kPictureHeight, 700, 710, 320, 240}, {}, 1, 2, {}});
    std::filesystem::create_directories(workspace_.MaskPath(0).parent_path());
    for (const char* kind : {"depth_maps", "normal_maps"})
      std::filesystem::create_directories(workspace_.folder / "stereo" / kind);
    options_.levels = 1;
    options_.window_radius = 5;
    options_.silhouette_margin_px = 2;
  }
  ~Crop() override { std::filesystem::remove_all(workspace_.folder); }

  DenseView Cut(int left, int top, int right, int bottom) {
    Image<std::uint8_t> mask(kPictureWidth, kPictureHeight);
    for (int y = top; y < bottom; ++y) std::fill(mask.row(y) + left, mask.row(y) + right, 255);
    WritePng(workspace_.MaskPath(0), mask);
    return CutToObject(workspace_, options_).views[0];
  }

  Workspace workspace_{
      std::filesystem::path(testing::TempDir()) / ("crop." + std::to_string(::getpid())), {}, true};
  StereoOptions options_;
};

TEST_F(Crop, LeavesTheObjectWithAMarginUnderTheSameRays) {
  const DenseView view = Cut(201, 100, 400, 301);
  ASSERT_TRUE(view.window);
  EXPECT_EQ(view.window->left, 192) << "eight pixels beside, and even";
  EXPECT_EQ(view.window->top, 92);
  EXPECT_EQ(view.camera.width, 408 - 192);
  EXPECT_EQ(view.camera.height, 310 - 92);
  const Eigen::Vector3d whole = workspace_.views[0].camera.Ray(300, 200);
  EXPECT_LT((view.camera.Ray(300 - 192, 200 - 92) - whole).norm(), 1e-12);
}

TEST_F(Crop, CoversTheSamePixelsAtEverySize) {
  options_.levels = 3;
  const DenseView view = Cut(203, 101, 501, 399);
  ASSERT_TRUE(view.window);
  EXPECT_EQ(view.window->left % 8, 0);
  EXPECT_EQ(view.window->top % 8, 0);
  EXPECT_LE(view.window->left, 203 - 4 * 8);
}

TEST_F(Crop, LeavesViewsWholeThatMayNotShowAllOfTheObject) {
  EXPECT_FALSE(Cut(0, 100, 400, 300).window);
  EXPECT_FALSE(Cut(100, 100, 400, kPictureHeight - 7).window);
  EXPECT_TRUE(Cut(100, 100, 400, kPictureHeight - 8).window);
  EXPECT_FALSE(Cut(0, 0, 0, 0).window) << "no object at all";
  Cut(100, 100, 400, 300);
  options_.masks = false;
  EXPECT_FALSE(CutToObject(workspace_, options_).views[0].window);
}

TEST_F(Crop, FinalMapsCoverTheWholePicture) {
  const DenseView view = Cut(201, 100, 400, 301);
  Workspace cut = workspace_;
  cut.views[0] = view;
  DepthNormalMap map{Image<float>(view.camera.width, view.camera.height, 1.5f),
                     {view.camera.width, view.camera.height, Eigen::Vector3f(0, 0, -1)}};
  WriteMaps(cut, 0, kSeparateMaps, map);
  EXPECT_EQ(ReadMaps(workspace_, 0, kSeparateMaps).depth.width(), view.camera.width);
  WriteMaps(cut, 0, kFinalMaps, map);
  const DepthNormalMap whole = ReadMaps(workspace_, 0, kFinalMaps);
  ASSERT_EQ(whole.depth.width(), kPictureWidth);
  ASSERT_EQ(whole.normal.height(), kPictureHeight);
  EXPECT_EQ(whole.depth(191, 92), 0);
  EXPECT_EQ(whole.depth(192, 92), 1.5f);
  EXPECT_EQ(whole.normal(407, 309).z(), -1);
  EXPECT_EQ(whole.normal(408, 309).z(), 0);
  const DepthNormalMap again = ReadMaps(cut, 0, kFinalMaps);
  EXPECT_EQ(again.depth.width(), view.camera.width);
  EXPECT_EQ(again.depth(0, 0), 1.5f);
}

}  // namespace
}  // namespace polarscan
