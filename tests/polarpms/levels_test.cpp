// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/levels.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "core/formats/image_io.h"

namespace polarscan {
namespace {

constexpr int kMaskWidth = 800, kMaskHeight = 600;

template <class Inside>
Levels OfOneMask(Inside&& inside) {
  const auto folder = std::filesystem::path(testing::TempDir()) / ("levels." + std::to_string(::getpid()));
  Workspace workspace{folder, {}, true};
  workspace.views.push_back({"v", {kMaskWidth, kMaskHeight, 900, 900, 400, 300}, {}, 1, 2, {}});
  Image<std::uint8_t> mask(kMaskWidth, kMaskHeight);
  for (int y = 0; y < kMaskHeight; ++y)
    for (int x = 0; x < kMaskWidth; ++x) mask(x, y) = inside(x, y) ? 255 : 0;
  std::filesystem::create_directories(workspace.MaskPath(0).parent_path());
  WritePng(workspace.MaskPath(0), mask);
  const Levels levels = ChooseLevels(workspace, {});
  std::filesystem::remove_all(folder);
  return levels;
}

auto Disc(double radius) {  // as wide as a strip of its radius
  return [=](int x, int y) { return std::hypot(x - 400, y - 300) < radius; };
}

TEST(Levels, AWideObjectIsSearchedAtAQuarterOfTheSize) {
  EXPECT_EQ(OfOneMask(Disc(200)).count, 3);
  EXPECT_EQ(OfOneMask([](int, int) { return true; }).count, 3);
}

TEST(Levels, LargePicturesWithoutMasksAreSearchedAtAboutThreeHundredPixels) {
  const auto levels = [](int width, int height) {
    Workspace workspace{"nowhere", {}, false};
    workspace.views.push_back({"v", {width, height, 900, 900, 400, 300}, {}, 1, 2, {}});
    StereoOptions options;
    options.masks = false;
    return ChooseLevels(workspace, options).count;
  };
  EXPECT_EQ(levels(1224, 1024), 3);
  EXPECT_EQ(levels(2448, 2048), 4);
  EXPECT_EQ(levels(5472, 3648), 5);
}

TEST(Levels, ThinPartsAreSearchedWhereTheyAreWideEnough) {
  const auto strips = [](int wide) { return [=](int x, int) { return x / wide % 2 == 1; }; };
  EXPECT_EQ(OfOneMask(strips(80)).count, 2);
  EXPECT_EQ(OfOneMask(strips(40)).count, 1);
  EXPECT_TRUE(OfOneMask(strips(40)).match_coarsest);
}

TEST(Levels, ASmallObjectIsSearchedAtFullSizeAndNotMatchedThere) {
  EXPECT_EQ(OfOneMask(Disc(60)).count, 1);
  EXPECT_FALSE(OfOneMask(Disc(60)).match_coarsest);
}

}  // namespace
}  // namespace polarscan
