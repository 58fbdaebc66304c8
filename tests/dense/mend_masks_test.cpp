// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/mend_masks.h"

#include <algorithm>
#include <cmath>

#include "ball_views.h"
#include "stereo/dense/masks/mask_fit.h"
#include "stereo/dense/masks/outline_steps.h"

namespace polarscan {
namespace {

using Mask = Image<std::uint8_t>;

// Bright balls before a darker wall with stripes and a grain.
class MendMasksTest : public BallViews {
 protected:
  MendMasksTest() : BallViews(2) {}

  void SetUp() override {
    BallViews::SetUp();
    for (int i = 0; i < kViews; ++i) {
      truth_.push_back(MaskOf(i));
      WriteStokes(workspace_.StokesPath(i), LightOf(i));
    }
  }

  StokesImage LightOf(int view) const {
    const Mask& mask = truth_[std::size_t(view)];
    const Image<float> distance = SignedDistance(mask);
    StokesImage light{Image<float>(mask.width(), mask.height()), Image<float>(mask.width(), mask.height()),
                      Image<float>(mask.width(), mask.height()),
                      Image<float>(mask.width(), mask.height(), 0.001f)};
    for (int y = 0; y < mask.height(); ++y)
      for (int x = 0; x < mask.width(); ++x) {
        const float grain = 0.01f * float((x * 7919 + y * 104729 + view * 31) % 17) / 17;
        const float wall = 0.2f + 0.06f * float((x / 23 + y / 31) % 2);
        light.s0(x, y) = grain + (mask(x, y) ? 0.6f - 0.004f * std::min(40.f, -distance(x, y)) : wall);
      }
    return light;
  }

  // Pixels within so many px of a mask, or as deep in it.
  static Mask Widened(const Mask& mask, double px) {
    const Image<float> distance = SignedDistance(mask);
    Mask wide(mask.width(), mask.height());
    for (std::size_t i = 0; i < wide.size(); ++i)
      wide.pixels()[i] = double(distance.pixels()[i]) < px ? 255 : 0;
    return wide;
  }
  // A disc of a mask's pixels, about its topmost one or its middle, set to a value.
  static Mask WithDisc(Mask mask, bool at_top, double radius, std::uint8_t value) {
    Eigen::Vector2d sum(0, 0), top(0, 1e9);
    int count = 0;
    for (int y = 0; y < mask.height(); ++y)
      for (int x = 0; x < mask.width(); ++x) {
        if (!mask(x, y)) continue;
        sum += Eigen::Vector2d(x, y), ++count;
        if (y < top.y()) top = {x, y};
      }
    const Eigen::Vector2d centre = at_top ? top : Eigen::Vector2d(sum / count);
    for (int y = 0; y < mask.height(); ++y)
      for (int x = 0; x < mask.width(); ++x)
        if ((Eigen::Vector2d(x, y) - centre).norm() < radius) mask(x, y) = value;
    return mask;
  }
  // Pixels that two masks share, of those that either has.
  static double Overlap(const Mask& a, const Mask& b) {
    int both = 0, either = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      both += a.pixels()[i] && b.pixels()[i];
      either += a.pixels()[i] || b.pixels()[i];
    }
    return double(both) / either;
  }

  MaskMending Mend() {
    Progress progress;
    return MendMasks(workspace_, progress);
  }
  void Put(int view, const Mask& mask) { WritePng(workspace_.MaskPath(view), mask); }
  double OverlapWithTruth(int view) const {
    return Overlap(ReadViewMask(workspace_, view), truth_[std::size_t(view)]);
  }

  std::vector<Mask> truth_;
};

TEST_F(MendMasksTest, RightMasksStayAsTheyAre) {
  const MaskMending mending = Mend();
  EXPECT_FALSE(mending.Any()) << MaskMendingWords(mending);
  EXPECT_EQ(MaskMendingWords(mending), "");
  for (int i = 0; i < kViews; ++i) EXPECT_EQ(OverlapWithTruth(i), 1);
}

TEST_F(MendMasksTest, MasksTooWideOrTooNarrowAsAWholeAreMoved) {
  for (const double px : {5., 3., -4.}) {
    for (int i = 0; i < kViews; ++i) Put(i, Widened(truth_[std::size_t(i)], px));
    const MaskMending mending = Mend();
    EXPECT_NEAR(mending.outside_px, -px, 1) << px;
    EXPECT_TRUE(mending.gaps.empty() && mending.surplus.empty()) << MaskMendingWords(mending);
    for (int i = 0; i < kViews; ++i) EXPECT_GT(OverlapWithTruth(i), 0.96) << px << ", view " << i;
  }
}

TEST_F(MendMasksTest, APieceThatOneMaskLacksIsFilledAndNamed) {
  Put(4, WithDisc(truth_[4], true, 12, 0));
  const MaskMending mending = Mend();
  EXPECT_EQ(mending.gaps, std::vector<std::string>{"v4"});
  EXPECT_TRUE(mending.surplus.empty());
  for (int i = 0; i < kViews; ++i) EXPECT_GT(OverlapWithTruth(i), i == 4 ? 0.98 : 0.9999) << i;
  EXPECT_NE(MaskMendingWords(mending).find("that of v4 had a piece missing"), std::string::npos);
}

TEST_F(MendMasksTest, APieceThatOneMaskHasAloneIsRemovedAndNamed) {
  Put(7, WithDisc(truth_[7], true, 14, 255));
  const MaskMending mending = Mend();
  EXPECT_EQ(mending.surplus, std::vector<std::string>{"v7"});
  EXPECT_TRUE(mending.gaps.empty());
  for (int i = 0; i < kViews; ++i) EXPECT_GT(OverlapWithTruth(i), i == 7 ? 0.97 : 0.9999) << i;
}

TEST_F(MendMasksTest, MasksOfOtherViewsAndWrongPosesAreLeftToBeNamed) {
  Mask inverted = truth_[3];
  for (std::uint8_t& pixel : inverted.pixels()) pixel = std::uint8_t(255 - pixel);
  Put(3, inverted);
  EXPECT_FALSE(Mend().Any());
  Progress progress;
  EXPECT_NE(MaskFitWords(MasksThatDoNotFit(workspace_, progress)), "");
}

TEST_F(MendMasksTest, FewMasksAreOutvotedByNone) {
  for (int i = 7; i < kViews; ++i) std::filesystem::remove(workspace_.MaskPath(i));
  Put(4, WithDisc(truth_[4], true, 12, 0));
  EXPECT_FALSE(Mend().Any());
}

}  // namespace
}  // namespace polarscan
