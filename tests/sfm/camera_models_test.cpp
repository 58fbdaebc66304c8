// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/model/camera_models.h"

#include "helpers.h"

namespace polarscan {
namespace {

TEST(CameraModels, DistortionIsTheWrittenFormula) {
  const Lens lens = ToLens({1, "OPENCV", 640, 480, {500, 510, 320, 240, 0.1, -0.05, 0.002, -0.003}});
  EXPECT_EQ(lens.pinhole.fx, 500);
  EXPECT_EQ(lens.pinhole.fy, 510);
  // x = 0.3, y = -0.2: r2 = 0.13, radial = 1 + 0.013 - 0.000845 = 1.012155
  const Eigen::Vector2d d = lens.Distort({0.3, -0.2});
  EXPECT_NEAR(d.x(), 0.3 * 1.012155 + 2 * 0.002 * -0.06 - 0.003 * (0.13 + 0.18), 1e-15);
  EXPECT_NEAR(d.y(), -0.2 * 1.012155 + 0.002 * (0.13 + 0.08) + 2 * -0.003 * -0.06, 1e-15);
}

TEST(CameraModels, ParametersLandWhereColmapPutsThem) {
  const Lens simple = ToLens({1, "SIMPLE_RADIAL", 640, 480, {500, 320, 240, 0.1}});
  EXPECT_EQ(simple.pinhole.fy, 500);
  EXPECT_EQ(simple.pinhole.cx, 320);
  EXPECT_EQ(simple.pinhole.cy, 240);
  EXPECT_EQ(simple.k1, 0.1);
  const Lens radial = ToLens({1, "RADIAL", 640, 480, {500, 320, 240, 0.1, 0.2}});
  EXPECT_EQ(radial.k1, 0.1);
  EXPECT_EQ(radial.k2, 0.2);
  const Lens pinhole = ToLens({1, "PINHOLE", 640, 480, {500, 510, 320, 240}});
  EXPECT_TRUE(pinhole.IsPinhole());
  EXPECT_EQ(pinhole.pinhole.cy, 240);
  EXPECT_EQ(ToPinhole({1, "SIMPLE_PINHOLE", 640, 480, {500, 320, 240}}).fy, 500);
}

TEST(CameraModels, FullOpencvWithoutItsLastParametersIsOpencv) {
  ColmapCamera camera{
      1, "FULL_OPENCV", 640, 480, {500, 510, 320, 240, 0.1, -0.05, 0.002, -0.003, 0, 0, 0, 0}};
  const Lens lens = ToLens(camera);
  EXPECT_EQ(lens.pinhole.fy, 510);
  EXPECT_EQ(lens.pinhole.cy, 240);
  EXPECT_EQ(lens.k2, -0.05);
  EXPECT_EQ(lens.p2, -0.003);
  camera.params[9] = 0.01;
  EXPECT_NE(ErrorOf([&] { ToLens(camera); }).find("k3 to k6"), std::string::npos);
}

TEST(CameraModels, UndistortInvertsDistort) {
  const Lens lens = ToLens({1, "OPENCV", 640, 480, {500, 510, 320, 240, -0.2, 0.05, 0.002, -0.003}});
  for (double x = -0.6; x <= 0.6; x += 0.1)
    for (double y = -0.5; y <= 0.5; y += 0.1) {
      const Eigen::Vector2d point(x, y);
      EXPECT_LT((lens.Undistort(lens.Distort(point)) - point).norm(), 1e-12);
    }
}

TEST(CameraModels, DistortionNeverTurnsTheFrameOfAngles) {
  const Lens lens = ToLens({1, "OPENCV", 640, 480, {500, 510, 320, 240, -0.2, 0.05, 0.02, -0.03}});
  const double h = 1e-6;
  for (const Eigen::Vector2d& p : {Eigen::Vector2d(0.4, 0.1), Eigen::Vector2d(-0.3, 0.35)}) {
    const Eigen::Vector2d dx =
        (lens.Distort(p + Eigen::Vector2d(h, 0)) - lens.Distort(p - Eigen::Vector2d(h, 0))) / (2 * h);
    const Eigen::Vector2d dy =
        (lens.Distort(p + Eigen::Vector2d(0, h)) - lens.Distort(p - Eigen::Vector2d(0, h))) / (2 * h);
    EXPECT_NEAR(dx.y(), dy.x(), 1e-9);  // symmetric Jacobian: no rotation
  }
}

TEST(CameraModels, UnsupportedLensesAreNamed) {
  const std::string message = ErrorOf([] {
    ToLens({1, "OPENCV_FISHEYE", 640, 480, std::vector<double>(8, 1.0)});
  });
  EXPECT_NE(message.find("OPENCV_FISHEYE"), std::string::npos);
  EXPECT_THROW(ToLens({1, "PINHOLE", 640, 480, {500, 500, 320}}), Error);
  EXPECT_THROW(ToLens({1, "PINHOLE", 640, 480, {500, -500, 320, 240}}), Error);
  EXPECT_THROW(ToPinhole({1, "SIMPLE_RADIAL", 640, 480, {500, 320, 240, 0.1}}), Error);
}

TEST(CameraModels, ResizedCameraProjectsToScaledPixels) {
  const ColmapCamera camera{1, "SIMPLE_RADIAL", 640, 480, {500, 320, 240, 0.1}};
  const Lens half = ToLens(Resized(camera, 320, 240)), full = ToLens(camera);
  const Eigen::Vector3d point(0.2, -0.1, 1.3);
  EXPECT_LT((half.pinhole.Project(point) - 0.5 * full.pinhole.Project(point)).norm(), 1e-12);
  EXPECT_EQ(half.k1, 0.1);
  EXPECT_THROW(Resized(camera, 320, 320), Error);
}

}  // namespace
}  // namespace polarscan
