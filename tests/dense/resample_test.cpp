// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/resample.h"

#include <limits>

#include "core/random.h"
#include "demosaic/polar_view.h"
#include "stereo/dense/undistort.h"
#include "tests/sfm/helpers.h"

namespace polarscan {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
const ColmapCamera kCurved{1, "OPENCV", 160, 120, {150, 155, 81, 59, -0.15, 0.03, 0.002, -0.001}};

// A view whose components are linear in the pixel position: interpolation is then exact.
StokesImage LinearView(int width, int height) {
  StokesImage image{Image<float>(width, height), Image<float>(width, height), Image<float>(width, height),
                    Image<float>(width, height, 0.02f)};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      image.s0(x, y) = float(x) + 0.5f;
      image.s1(x, y) = float(y) + 0.5f;
      image.s2(x, y) = 1.f;
    }
  return image;
}

TEST(Resample, PixelsComeFromWhereTheLensPutThem) {
  const Lens lens = ToLens(kCurved);
  const Resampling way = MakeResampling(lens, 0);
  const StokesImage result = Resample(LinearView(160, 120), way);
  int valid = 0;
  for (int y = 0; y < 120; y += 7)
    for (int x = 0; x < 160; x += 7) {
      if (!std::isfinite(result.noise(x, y))) continue;
      ++valid;
      // The ray of this pixel in the straight camera, through the lens, lands on (s0, s1) of the taken
      // picture.
      const Eigen::Vector2d distorted = lens.Distort(way.camera.Ray(x + 0.5, y + 0.5).head<2>());
      EXPECT_NEAR(result.s0(x, y), 150 * distorted.x() + 81, 0.03);  // OpenCV rounds positions to 1/32 pixel
      EXPECT_NEAR(result.s1(x, y), 155 * distorted.y() + 59, 0.03);
      EXPECT_NEAR(result.s2(x, y), 1, 1e-6);
      EXPECT_NEAR(result.noise(x, y), 0.02, 1e-6);
    }
  EXPECT_GT(valid, 300);
}

TEST(Resample, BlankPixelsAreInvalid) {
  // A pincushion lens took a picture that, straightened, does not fill its frame.
  const ColmapCamera pincushion{1, "SIMPLE_RADIAL", 160, 120, {150, 80, 60, 0.3}};
  const StokesImage result = Resample(LinearView(160, 120), MakeResampling(ToLens(pincushion), 0));
  EXPECT_EQ(result.noise(0, 0), kInfinity);
  EXPECT_EQ(result.s0(0, 0), 0);
  EXPECT_TRUE(std::isfinite(result.noise(80, 60)));
}

TEST(Resample, WhatTouchesAnInvalidPixelIsInvalidAndNothingElse) {
  StokesImage image = LinearView(160, 120);
  image.noise(70, 50) = kInfinity;
  image.s0(70, 50) = std::numeric_limits<float>::quiet_NaN();
  const Lens lens = ToLens(kCurved);
  const Resampling way = MakeResampling(lens, 0);
  const StokesImage result = Resample(image, way), whole = Resample(LinearView(160, 120), way);
  for (int y = 40; y < 60; ++y)
    for (int x = 60; x < 80; ++x) {
      const Eigen::Vector2d d = lens.Distort(way.camera.Ray(x + 0.5, y + 0.5).head<2>());
      const double dx = std::abs(150 * d.x() + 81 - 70.5), dy = std::abs(155 * d.y() + 59 - 50.5);
      if (dx < 0.95 && dy < 0.95) {
        EXPECT_EQ(result.noise(x, y), kInfinity) << x << " " << y;
        EXPECT_EQ(result.s0(x, y), 0);
      }
      if (dx > 1.05 || dy > 1.05) {
        EXPECT_EQ(result.s0(x, y), whole.s0(x, y)) << x << " " << y;
      }
    }
}

TEST(Resample, HalfSizeAveragesFourPixelsAndHalvesTheNoise) {
  const Resampling way = MakeResampling(ToLens({1, "PINHOLE", 160, 120, {150, 150, 80, 60}}), 80);
  EXPECT_EQ(way.camera.width, 80);
  EXPECT_EQ(way.camera.height, 60);
  EXPECT_EQ(way.camera.fx, 75);
  EXPECT_EQ(way.camera.cx, 40);
  StokesImage image = LinearView(160, 120);
  image.noise(6, 8) = kInfinity;
  const StokesImage half = Resample(image, way);
  EXPECT_FLOAT_EQ(half.s0(10, 20), 21);  // pixel centres 20.5 and 21.5
  EXPECT_FLOAT_EQ(half.s1(10, 20), 41);
  EXPECT_FLOAT_EQ(half.noise(10, 20), 0.01f);
  EXPECT_EQ(half.noise(3, 4), kInfinity);
  EXPECT_TRUE(std::isfinite(half.noise(4, 4)));
}

// The mosaic of even light with independent noise, demosaiced, at several sizes: what the view says of its
// noise against what it has.
void ExpectRightNoiseAtEverySize(const DemosaicMethod& method, const std::string& layout) {
  const int size = 400;
  Sensor sensor;
  sensor.layout = ParseLayout(layout);
  sensor.bits = 32, sensor.white_dn = 1, sensor.clips = false;
  sensor.dn_per_e = 1e-9, sensor.read_noise_e = 5e6;
  const std::array<float, 4> light = {0.55f, 0.45f, 0.35f, 0.45f};  // at 0, 45, 90, 135 degrees
  Image<float> mosaic(size, size);
  Random random(5);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      mosaic(x, y) = light[std::size_t(sensor.layout.AngleAt(x, y) / 45)] + 0.005f * float(random.Normal());
  const StokesImage full = ViewFromMosaic(mosaic, sensor, method).stokes;
  const ColmapCamera camera{1, "PINHOLE", size, size, {400, 400, 200, 200}};
  for (const int smaller : {400, 267, 200, 100}) {
    const StokesImage image = Resample(full, MakeResampling(ToLens(camera), smaller));
    double intensity = 0, polarization = 0, count = 0;
    for (int y = smaller / 10; y < smaller * 9 / 10; ++y)
      for (int x = smaller / 10; x < smaller * 9 / 10; ++x, ++count) {
        intensity += std::pow(image.s0(x, y) - 0.9, 2);
        polarization += (std::pow(image.s1(x, y) - 0.2, 2) + std::pow(image.s2(x, y), 2)) / 4;
      }
    const double noise = image.noise(smaller / 2, smaller / 2),
                 most = method.name == "superpixel" ? 0.3 : 0.22;
    EXPECT_NEAR(noise / std::sqrt(polarization / count), 1, most) << method.name << layout << smaller;
    EXPECT_NEAR(image.s0_noise * noise / std::sqrt(intensity / count), 1, most)
        << method.name << layout << smaller;
  }
}

TEST(Resample, DemosaicedViewsKnowTheirNoiseAtEverySize) {
  for (const DemosaicMethod& method : DemosaicMethods())
    for (const char* layout : {"90 45 / 135 0", "90 45 / 135 0 rggb"})
      ExpectRightNoiseAtEverySize(method, layout);
}

TEST(Resample, MasksStayBinary) {
  Image<std::uint8_t> mask(160, 120);
  for (int y = 0; y < 120; ++y)
    for (int x = 80; x < 160; ++x) mask(x, y) = 255;
  const Image<std::uint8_t> result = Resample(mask, MakeResampling(ToLens(kCurved), 80));
  EXPECT_EQ(result.width(), 80);
  EXPECT_EQ(result(20, 30), 0);
  EXPECT_EQ(result(60, 30), 255);
  for (const std::uint8_t value : result.pixels()) EXPECT_TRUE(value == 0 || value == 255);
}

class UndistortAgainstColmap : public FolderTest {};

// Colmap's image_undistorter chooses its own target camera; through that camera our picture must be the same
// as its.
TEST_F(UndistortAgainstColmap, GivesTheSamePicture) {
  if (!HasColmap()) GTEST_SKIP() << "COLMAP is not installed";
  Image<std::uint8_t> grey(160, 120);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x)
      grey(x, y) = std::uint8_t(128 + 60 * std::sin(x * 0.2) + 60 * std::cos(y * 0.15));
  SparseModel model;
  model.cameras[1] = kCurved;
  for (std::uint32_t id : {1u, 2u}) {
    const std::string name = id == 1 ? "a.png" : "b.png";
    model.images[id] = {id, 1, {Eigen::Matrix3d::Identity(), {double(id), 0, 0}}, name, {}};
    WritePng(folder / "images" / name, grey);
  }
  WriteSparseModelBinary(folder / "sparse", model);
  Progress progress;
  RunProcess({"colmap", "image_undistorter", "--image_path", folder / "images", "--input_path",
              folder / "sparse", "--output_path", folder / "out"},
             folder / "log", progress, 60);
  ASSERT_TRUE(std::filesystem::exists(folder / "out/images/a.png")) << ReadFile(folder / "log");
  const Pinhole target = ToPinhole(ReadSparseModel(folder / "out/sparse").cameras.begin()->second);
  const Picture theirs = ReadPicture(folder / "out/images/a.png"),
                taken = ReadPicture(folder / "images/a.png");

  const Resampling way = MakeResampling(ToLens(kCurved), 0);
  const Picture ours = Resample(taken, way);
  // Their pixel (u, v) looks along a ray that falls between our pixels: interpolate there.
  double sum = 0, count = 0, worst = 0;
  for (int v = 3; v < target.height - 3; ++v)
    for (int u = 3; u < target.width - 3; ++u) {
      const Eigen::Vector2d at = way.camera.Project(target.Ray(u + 0.5, v + 0.5)) - Eigen::Vector2d(0.5, 0.5);
      const int x = int(std::floor(at.x())), y = int(std::floor(at.y()));
      if (x < 2 || y < 2 || x > 156 || y > 116) continue;
      const double fx = at.x() - x, fy = at.y() - y;
      const Image<float>& p = ours.planes[0];
      const double value = (1 - fy) * ((1 - fx) * p(x, y) + fx * p(x + 1, y)) +
                           fy * ((1 - fx) * p(x, y + 1) + fx * p(x + 1, y + 1));
      const double difference = std::abs(value - theirs.planes[0](u, v));
      sum += difference;
      worst = std::max(worst, difference);
      ++count;
    }
  ASSERT_GT(count, 10000);
  EXPECT_LT(sum / count, 0.7);  // grey levels; half a pixel of shift would be about 4
  EXPECT_LT(worst, 4);
}

}  // namespace
}  // namespace polarscan
