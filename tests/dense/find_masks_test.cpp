// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/finding/find_masks.h"

#include <algorithm>

#include "ball_views.h"

namespace polarscan {
namespace {

using Plane = Image<float>;

// Balls, lit from one side, before a wall that is lit unevenly and has a grain.
class FindMasksTest : public BallViews {
 protected:
  FindMasksTest() : BallViews(2) {}

  void SetUp() override {
    BallViews::SetUp();
    for (int i = 0; i < kViews; ++i)
      truth_.push_back(MaskOf(i)), std::filesystem::remove(workspace_.MaskPath(i));
  }

  // wall: S0 of the wall at (x, y) of a view. shift: of the balls, px, so that they are not the same in all views.
  template <class Wall>
  void Write(
      Wall&& wall, int (*shift)(int view) = [](int) { return 0; }) const {
    for (int i = 0; i < kViews; ++i) {
      const int width = truth_[0].width(), height = truth_[0].height();
      StokesImage light{Plane(width, height), Plane(width, height), Plane(width, height),
                        Plane(width, height, 0.001f)};
      const int middle = darkness_ > 0 ? MiddleOf(truth_[std::size_t(i)]) : 0;
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
          const float grain = 0.01f * float((x * 7919 + y * 104729 + i * 31) % 17) / 17;
          const int from = x - shift(i);
          const bool ball = from >= 0 && from < width && truth_[std::size_t(i)](from, y);
          light.s0(x, y) =
              grain + (ball ? BallLight(x - middle, width) + spread_ * float(i * 7 % 11) : wall(x, y, i));
        }
      WriteStokes(workspace_.StokesPath(i), light);
    }
  }
  static float Uneven(int x, int y, int) { return 0.1f + 2e-4f * float(x) + 1e-6f * float(y) * float(y); }

  float BallLight(int x, int width) const {
    return darkness_ > 0 ? std::max(0.f, 0.5f - darkness_ * float(x))
                         : 0.35f + 0.5f * float(x) / float(width);
  }
  // Column, px.
  static int MiddleOf(const Image<std::uint8_t>& mask) {
    std::int64_t sum = 0, count = 0;
    for (int y = 0; y < mask.height(); ++y)
      for (int x = 0; x < mask.width(); ++x)
        if (mask(x, y)) sum += x, ++count;
    return int(sum / std::max<std::int64_t>(1, count));
  }

  // Of pixels that a view's mask and the truth share, of those that either has.
  double Overlap(int view) const {
    const Image<std::uint8_t> mask = ReadViewMask(workspace_, view), &truth = truth_[std::size_t(view)];
    if (mask.empty()) return 0;
    int both = 0, either = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) {
      both += mask.pixels()[i] && truth.pixels()[i];
      either += mask.pixels()[i] || truth.pixels()[i];
    }
    return double(both) / either;
  }
  std::size_t MaskFiles() const {
    const std::filesystem::path masks = workspace_.folder / "masks";
    return std::size_t(std::distance(std::filesystem::directory_iterator(masks), {}));
  }

  float spread_ = 0;    // of the balls' S0 from view to view, as where they turn before lamps
  float darkness_ = 0;  // S0 a px that the balls lose to the right of their middle
  Progress silent_;
  std::vector<Image<std::uint8_t>> truth_;
};

TEST_F(FindMasksTest, AnObjectBeforeAPlainBackgroundIsFoundToThePixel) {
  Write(Uneven);
  EXPECT_EQ(FindMasks({}, workspace_, silent_).views, std::size_t(kViews));
  for (int i = 0; i < kViews; ++i) EXPECT_GT(Overlap(i), 0.97) << i;
}

TEST_F(FindMasksTest, ABlackBackgroundIsPlain) {
  Write([](int, int, int) { return 0.f; });
  EXPECT_EQ(FindMasks({}, workspace_, silent_).views, std::size_t(kViews));
  for (int i = 0; i < kViews; ++i) EXPECT_GT(Overlap(i), 0.97) << i;
}

// A print of squares of 6 px, each of another grey.
float Squares(int x, int y) { return 0.1f + 0.3f * float((x / 6 * 7919 + y / 6 * 104729) % 101) / 101; }

TEST_F(FindMasksTest, BeforeAWallWithTextureThatMovesThereAreNone) {
  Write([](int x, int y, int view) { return Squares(x + 50 * view, y); });
  const FoundMasks found = FindMasks({}, workspace_, silent_);
  EXPECT_EQ(found.views, 0u);
  EXPECT_EQ(FoundMasksWords(found), "");
  EXPECT_EQ(MaskFiles(), 0u);
}

TEST_F(FindMasksTest, AnObjectThatTurnsBeforeAWallThatStandsStillIsFoundToThePixel) {
  spread_ = 0.02f;
  Write([](int x, int y, int) { return Squares(x, y); });
  const FoundMasks found = FindMasks({}, workspace_, silent_);
  EXPECT_EQ(found.views, std::size_t(kViews)) << FoundMasksWords(found);
  EXPECT_NE(FoundMasksWords(found).find("stands still"), std::string::npos) << FoundMasksWords(found);
  for (int i = 0; i < kViews; ++i) EXPECT_GT(Overlap(i), 0.97) << i;
}

TEST_F(FindMasksTest, AFlickeringLampDoesNotHarmThem) {
  spread_ = 0.02f;
  Write([](int x, int y, int view) { return Squares(x, y) * (view % 3 == 0 ? 0.8f : 1.f); });
  const FoundMasks found = FindMasks({}, workspace_, silent_);
  EXPECT_EQ(found.views, std::size_t(kViews)) << FoundMasksWords(found);
  for (int i = 0; i < kViews; ++i) EXPECT_GT(Overlap(i), 0.96) << i;
}

// Two stands of the camera: the wall is elsewhere in the second half.
TEST_F(FindMasksTest, EachStandOfACameraHasItsOwnBackground) {
  spread_ = 0.02f;
  Write([](int x, int y, int view) { return Squares(x + (view < kViews / 2 ? 0 : 500), y); });
  const FoundMasks found = FindMasks({}, workspace_, silent_);
  EXPECT_EQ(found.views, std::size_t(kViews)) << FoundMasksWords(found);
  double sum = 0;
  for (int i = 0; i < kViews; ++i)
    sum += Overlap(i);  // some places are free in too few of the ten pictures of a stand
  EXPECT_GT(sum / kViews, 0.95);
}

TEST_F(FindMasksTest, SomebodyInTwoPicturesIsNoPartOfTheObject) {
  spread_ = 0.02f;
  Write([](int x, int y, int view) {
    const bool visitor = view % 9 == 3 && x > 20 + view && x < 60 + view && y > 60;
    return visitor ? 0.7f : Squares(x, y);
  });
  EXPECT_EQ(FindMasks({}, workspace_, silent_).views, std::size_t(kViews));
  for (int i = 0; i < kViews; ++i) EXPECT_GT(Overlap(i), 0.95) << i;
}

// A label on the lens, or a time in the picture's corner, is no background.
TEST_F(FindMasksTest, ALittleThatStandsStillBeforeAMovingCameraIsNoBackground) {
  Write([](int x, int y, int view) {
    return x < 90 && y < 60 ? Squares(3 * x, 3 * y) : Squares(x + 50 * view, y);
  });
  const FoundMasks found = FindMasks({}, workspace_, silent_);
  EXPECT_EQ(found.views, 0u) << FoundMasksWords(found);
  EXPECT_EQ(MaskFiles(), 0u);
}

TEST_F(FindMasksTest, AHalfOfTheBackgroundThatMovesGivesNone) {
  spread_ = 0.02f;
  Write([](int x, int y, int view) { return x < 140 ? Squares(x, y) : Squares(x + 50 * view, y); });
  const FoundMasks found = FindMasks({}, workspace_, silent_);
  EXPECT_EQ(found.views, 0u) << FoundMasksWords(found);
}

TEST_F(FindMasksTest, ASideThatIsAsDarkAsTheBackgroundGivesNone) {
  darkness_ = 0.02f;
  Write([](int, int, int) { return 0.f; });
  const FoundMasks found = FindMasks({}, workspace_, silent_);
  EXPECT_EQ(found.views, 0u);
  EXPECT_NE(FoundMasksWords(found).find("in the dark"), std::string::npos) << FoundMasksWords(found);
  EXPECT_EQ(MaskFiles(), 0u);
}

TEST_F(FindMasksTest, WhatIsNotOneObjectFromAllSidesGivesNone) {
  Write(Uneven, [](int view) { return view * 37 % 160 - 80; });
  const FoundMasks found = FindMasks({}, workspace_, silent_);
  EXPECT_EQ(found.views, 0u);
  EXPECT_NE(FoundMasksWords(found).find("not one object"), std::string::npos) << FoundMasksWords(found);
  EXPECT_EQ(MaskFiles(), 0u);
}

}  // namespace
}  // namespace polarscan
