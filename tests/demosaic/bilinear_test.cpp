// SPDX-License-Identifier: Apache-2.0
#include "demosaic/methods/bilinear.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "core/error.h"
#include "core/formats/image_io.h"
#include "mosaic.h"

namespace polarscan {
namespace {

using test::Stokes;

// Linear in x and y, another one in each colour.
Stokes Slope(int x, int y, char colour) {
  const double k = colour == 'r' ? 1 : colour == 'g' ? 2 : colour == 'b' ? 3 : 0.5;
  return {0.5 + 0.01 * k * x + 0.02 * y, 0.1 - 0.003 * x + 0.002 * k * y, -0.05 + 0.001 * k * x - 0.004 * y};
}

// The largest error against the scene in the pixels at least `border` away from the edge.
double LargestError(const std::vector<AnglePlanes>& colours, const std::string& names,
                    const test::Scene& scene, int border) {
  double largest = 0;
  for (std::size_t c = 0; c < colours.size(); ++c)
    for (std::size_t a = 0; a < 4; ++a)
      for (int y = border; y < colours[c][a].height() - border; ++y)
        for (int x = border; x < colours[c][a].width() - border; ++x) {
          const double truth = test::Behind(scene(x, y, names[c]), kAnglesDeg[a]);
          largest = std::max(largest, std::abs(colours[c][a](x, y) - truth));
        }
  return largest;
}

TEST(Bilinear, ReturnsALinearSceneExactlyInsideForEveryMonoLayout) {
  for (const Layout& layout : test::AllLayouts("")) {
    const auto planes = InterpolateBilinear(test::TakeMosaic(17, 14, layout, Slope), layout);
    ASSERT_EQ(planes.size(), 1u);
    EXPECT_LT(LargestError(planes, "m", Slope, 1), 1e-6) << ToString(layout);
  }
}

TEST(Bilinear, ReturnsALinearSceneExactlyInsideForEveryColourLayout) {
  for (const char* bayer : {"rggb", "bggr", "grbg", "gbrg"})
    for (const Layout& layout : test::AllLayouts(bayer)) {
      const auto colours = InterpolateBilinear(test::TakeMosaic(21, 18, layout, Slope), layout);
      ASSERT_EQ(colours.size(), 3u);
      EXPECT_LT(LargestError(colours, "rgb", Slope, 3), 1e-6) << ToString(layout);
    }
}

TEST(Bilinear, ReturnsAConstantSceneExactlyUpToTheBorder) {
  const test::Scene constant = [](int, int, char colour) { return Stokes{0.6, 0.1 * (colour == 'b'), -0.2}; };
  for (const char* bayer : {"", "rggb", "bggr", "grbg", "gbrg"})
    for (const int width : {4, 5, 6, 7, 12}) {
      const Layout layout = {{90, 45, 135, 0}, bayer};
      const auto planes =
          InterpolateBilinear(test::TakeMosaic(width, 4 + width % 3, layout, constant), layout);
      EXPECT_LT(LargestError(planes, *bayer ? "rgb" : "m", constant, 0), 1e-6) << bayer << width;
    }
}

TEST(Bilinear, RefusesAMosaicThatIsTooSmall) {
  EXPECT_THROW(InterpolateBilinear(Image<float>(3, 8), {}), Error);
  EXPECT_THROW(InterpolateBilinear({}, {}), Error);
}

// Peak signal-to-noise ratio in dB, peak 1, without 15 pixels at the border.
class Psnr {
 public:
  void Add(const Image<float>& image, const Image<float>& truth, float factor = 1) {
    for (int y = 15; y < image.height() - 15; ++y)
      for (int x = 15; x < image.width() - 15; ++x) {
        const double error = factor * (image(x, y) - truth(x, y));
        sum_ += error * error, ++count_;
      }
  }
  double Db() const { return -10 * std::log10(sum_ / double(count_)); }

 private:
  double sum_ = 0;
  std::size_t count_ = 0;
};

std::vector<Picture> ReadTruth(const std::string& scene) {
  std::vector<Picture> pictures;
  for (const int angle : kAnglesDeg) {
    pictures.push_back(ReadPicture(std::filesystem::path(POLARSCAN_SHARED) / "data/demosaic-gt" /
                                   (scene + "_" + std::to_string(angle) + ".png")));
    for (Image<float>& plane : pictures.back().planes)
      for (float& value : plane.pixels()) value /= pictures.back().full_scale;
  }
  return pictures;
}

// The mosaic that a sensor of this layout would have taken of full-resolution planes.
Image<float> Resample(const std::vector<Picture>& truth, const Layout& layout, std::size_t mono_plane) {
  Image<float> mosaic(truth[0].width(), truth[0].height());
  for (int y = 0; y < mosaic.height(); ++y)
    for (int x = 0; x < mosaic.width(); ++x) {
      const char colour = layout.ColourAt(x, y);
      const std::size_t plane = colour == 'm' ? mono_plane : std::string("rgb").find(colour);
      mosaic(x, y) = truth[std::size_t(layout.AngleAt(x, y) / 45)].planes[plane](x, y);
    }
  return mosaic;
}

// An independent program (OpenCV's Bayer and polanalyser's polarization bilinear) got 33.1 dB for the
// intensities of the car and 35.6 dB for those of the bear (notes/demosaic-and-data.md A1.4; of the bear we
// have a crop only).
TEST(Bilinear, IsAsGoodOnColourTruthAsAnIndependentProgram) {
  if (!std::filesystem::exists(std::filesystem::path(POLARSCAN_SHARED) / "data/demosaic-gt/car_0.png"))
    GTEST_SKIP() << "../shared/data/demosaic-gt is not there";
  const std::vector<Picture> truth = ReadTruth("car");
  const Layout layout = ParseLayout("90 45 / 135 0 rggb");
  const auto colours = InterpolateBilinear(Resample(truth, layout, 0), layout);
  double mean = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    Psnr psnr;
    for (std::size_t a = 0; a < 4; ++a) psnr.Add(colours[c][a], truth[a].planes[c]);
    mean += psnr.Db() / 3;
  }
  EXPECT_NEAR(mean, 33.1, 0.3);
}

// Notes A1.3: 38.0 dB is the mean for 10 planes of four scenes.
TEST(Bilinear, IsAsGoodOnMonoTruthAsAnIndependentProgram) {
  if (!std::filesystem::exists(std::filesystem::path(POLARSCAN_SHARED) / "data/demosaic-gt/car_0.png"))
    GTEST_SKIP() << "../shared/data/demosaic-gt is not there";
  const Layout layout = ParseLayout("90 45 / 135 0");
  double mean = 0;
  int planes = 0;
  for (const auto& [scene, colours] : std::vector<std::pair<std::string, std::vector<std::size_t>>>{
           {"car", {0, 1, 2}}, {"bear_crop", {0, 1, 2}}, {"bubblewrap_crop", {0, 1, 2}}, {"woodwall", {1}}}) {
    const std::vector<Picture> truth = ReadTruth(scene);
    for (const std::size_t colour : colours) {
      const auto result = InterpolateBilinear(Resample(truth, layout, colour), layout);
      Psnr psnr;
      for (std::size_t a = 0; a < 4; ++a) psnr.Add(result[0][a], truth[a].planes[colour]);
      mean += psnr.Db(), ++planes;
    }
  }
  EXPECT_NEAR(mean / planes, 38.02, 1.5);  // crops of two scenes are not the whole scenes
}

}  // namespace
}  // namespace polarscan
