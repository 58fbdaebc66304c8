// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <numbers>

#include "stereo/workspace.h"
#include "tests/sfm/helpers.h"

namespace polarscan {

// Two balls of unlike size, off the axis of a ring of cameras that look at its middle, and their masks. zoom: of pictures
// of 160 x 120 pixels.
class BallViews : public FolderTest {
 protected:
  explicit BallViews(int zoom) : zoom_(zoom) {}
  static constexpr int kViews = 20;

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
      view.camera = {160 * zoom_, 120 * zoom_, 200. * zoom_, 200. * zoom_, 80. * zoom_, 60. * zoom_};
      view.cam_from_world = {Eigen::Quaterniond(rotation).toRotationMatrix(), Eigen::Vector3d(0, 0, 6)};
      view.depth_min = 3, view.depth_max = 9;
      workspace_.views.push_back(view);
    }
    for (int i = 0; i < kViews; ++i) WritePng(workspace_.MaskPath(i), MaskOf(i));
  }

  Image<std::uint8_t> MaskOf(int view) const {
    const DenseView& v = workspace_.views[std::size_t(view)];
    Image<std::uint8_t> mask(v.camera.width, v.camera.height);
    for (int y = 0; y < mask.height(); ++y)
      for (int x = 0; x < mask.width(); ++x)
        for (const auto& [centre, radius] :
             {std::pair(Eigen::Vector3d(0.9, 0, 0.1), 0.5), {Eigen::Vector3d(-0.3, 0.5, 0), 0.3}}) {
          const Eigen::Vector3d c = v.cam_from_world * centre,
                                ray = v.camera.Ray(x + 0.5, y + 0.5).normalized();
          if ((c - c.dot(ray) * ray).norm() < radius) mask(x, y) = 255;
        }
    return mask;
  }

  Workspace workspace_;

 private:
  int zoom_;
};

}  // namespace polarscan
