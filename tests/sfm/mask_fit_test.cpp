// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/mask_fit.h"

#include <numbers>

#include "helpers.h"

namespace polarscan {
namespace {

// Two balls of unlike size, off the axis of a ring of cameras that look at its middle.
class MaskFit : public FolderTest {
 protected:
  static constexpr int kViews = 10, kWidth = 160, kHeight = 120;

  void SetUp() override {
    FolderTest::SetUp();
    workspace_.folder = folder;
    for (int i = 0; i < kViews; ++i) {
      const double turn = 2 * std::numbers::pi * i / kViews + 0.3 * i * i / kViews;
      Eigen::Matrix3d rotation;
      rotation.row(2) = Eigen::RowVector3d(-std::cos(turn), -std::sin(turn), -0.5).normalized();
      rotation.row(0) = Eigen::RowVector3d(0, 0, -1).cross(Eigen::RowVector3d(rotation.row(2))).normalized();
      rotation.row(1) = rotation.row(2).cross(rotation.row(0));
      DenseView view;
      view.name = "v" + std::to_string(i);
      view.camera = {kWidth, kHeight, 200, 200, kWidth / 2., kHeight / 2.};
      view.cam_from_world = {Eigen::Quaterniond(rotation).toRotationMatrix(), Eigen::Vector3d(0, 0, 6)};
      view.depth_min = 3, view.depth_max = 9;
      workspace_.views.push_back(view);
    }
    for (int i = 0; i < kViews; ++i) WritePng(workspace_.MaskPath(i), MaskOf(i));
  }

  Image<std::uint8_t> MaskOf(int view) const {
    const DenseView& v = workspace_.views[std::size_t(view)];
    Image<std::uint8_t> mask(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (const auto& [centre, radius] :
             {std::pair(Eigen::Vector3d(0.9, 0, 0.1), 0.5), {Eigen::Vector3d(-0.3, 0.5, 0), 0.3}}) {
          const Eigen::Vector3d c = v.cam_from_world * centre,
                                ray = v.camera.Ray(x + 0.5, y + 0.5).normalized();
          if ((c - c.dot(ray) * ray).norm() < radius) mask(x, y) = 255;
        }
    return mask;
  }
  std::string Words() const {
    Progress progress;
    return MaskFitWords(MasksThatDoNotFit(workspace_, progress));
  }

  Workspace workspace_;
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
