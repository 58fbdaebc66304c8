// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/mask_fit.h"

#include "ball_views.h"

namespace polarscan {
namespace {

class MaskFit : public BallViews {
 protected:
  MaskFit() : BallViews(1) {}

  std::string Words() const {
    Progress progress;
    return MaskFitWords(MasksThatDoNotFit(workspace_, progress));
  }
};

TEST_F(MaskFit, RightMasksAndRightPosesAreNotDoubted) { EXPECT_EQ(Words(), ""); }

TEST_F(MaskFit, AMaskThatIsInvertedOrAnotherViewsIsNamed) {
  Image<std::uint8_t> inverted = MaskOf(3);
  for (std::uint8_t& pixel : inverted.pixels()) pixel = std::uint8_t(255 - pixel);
  WritePng(workspace_.MaskPath(3), inverted);
  EXPECT_NE(Words().find("the mask of v3 does not fit the others"), std::string::npos) << Words();
  WritePng(workspace_.MaskPath(3), MaskOf(8));
  EXPECT_NE(Words().find("the mask of v3 does not fit the others"), std::string::npos) << Words();
}

TEST_F(MaskFit, PosesOfOtherPicturesAreNamed) {
  const std::vector<DenseView> right = workspace_.views;
  for (int i = 0; i < kViews; ++i)
    workspace_.views[std::size_t(i)].cam_from_world = right[std::size_t((i + 3) % kViews)].cam_from_world;
  std::reverse(workspace_.views.begin(), workspace_.views.end());
  for (int i = 0; i < kViews; ++i) workspace_.views[std::size_t(i)].name = right[std::size_t(i)].name;
  EXPECT_NE(Words().find("masks and poses do not fit each other"), std::string::npos) << Words();
}

TEST_F(MaskFit, FewMasksSayNothing) {
  for (int i = 3; i < kViews; ++i) std::filesystem::remove(workspace_.MaskPath(i));
  WritePng(workspace_.MaskPath(0), MaskOf(5));
  EXPECT_EQ(Words(), "");
}

}  // namespace
}  // namespace polarscan
