// SPDX-License-Identifier: Apache-2.0
#include "demosaic/polar_view.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

#include "core/error.h"
#include "core/random.h"
#include "mosaic.h"
#include "twelve_bits.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
using test::Bilinear;
using test::Stokes;
using test::ToCounts;
using test::TwelveBits;

double Degrees(float radians) { return radians * 180 / 3.14159265358979; }

TEST(Mosaic, GivesStokesInUnitsOfFullScaleWithBlackSubtracted) {
  for (const char* layout : {"90 45 / 135 0", "0 45 / 135 90", "135 0 / 90 45 bggr"}) {
    const Sensor sensor = TwelveBits(layout);
    const test::Scene scene = [](int, int, char) { return Stokes{0.8, 0.3, -0.1}; };
    const PolarView view =
        ViewFromMosaic(ToCounts(test::TakeMosaic(16, 12, sensor.layout, scene), sensor), sensor, Bilinear());
    EXPECT_NEAR(view.stokes.s0(7, 5), 0.8, 1e-3);
    EXPECT_NEAR(view.stokes.s1(7, 5), 0.3, 1e-3);
    EXPECT_NEAR(view.stokes.s2(7, 5), -0.1, 1e-3);
  }
}

TEST(Mosaic, OfAColourSensorGivesTheColoursAndTheirMean) {
  const Sensor sensor = TwelveBits("90 45 / 135 0 grbg");
  const test::Scene scene = [](int, int, char c) {
    return Stokes{c == 'r' ? 0.9 : c == 'g' ? 0.6 : 0.3, 0.1, 0};
  };
  const PolarView view =
      ViewFromMosaic(ToCounts(test::TakeMosaic(20, 20, sensor.layout, scene), sensor), sensor, Bilinear());
  ASSERT_EQ(view.colour_s0.size(), 3u);
  EXPECT_NEAR(view.colour_s0[0](9, 9), 0.9, 1e-3);
  EXPECT_NEAR(view.colour_s0[1](9, 9), 0.6, 1e-3);
  EXPECT_NEAR(view.colour_s0[2](9, 9), 0.3, 1e-3);
  EXPECT_NEAR(view.stokes.s0(9, 9), 0.6, 1e-3);
}

TEST(Mosaic, SwappingTwoDiagonalAnglesMirrorsTheSense) {
  const test::Scene scene = [](int, int, char) { return Stokes{1, 0.3, 0.2}; };
  const Sensor right = TwelveBits("90 45 / 135 0"), swapped = TwelveBits("90 135 / 45 0");
  const Image<float> counts = ToCounts(test::TakeMosaic(12, 12, right.layout, scene), right);
  const StokesImage a = ViewFromMosaic(counts, right, Bilinear()).stokes,
                    b = ViewFromMosaic(counts, swapped, Bilinear()).stokes;
  EXPECT_NEAR(Degrees(AngleOfPolarization(a.s1(5, 5), a.s2(5, 5))) +
                  Degrees(AngleOfPolarization(b.s1(5, 5), b.s2(5, 5))),
              180, 0.1);
}

TEST(Stokes, NotANumberIsInvalidAndZero) {
  Picture s0{{Image<float>(5, 5, 1)}, 1, 32}, s1 = s0, s2 = s0;
  s1.planes[0](2, 2) = std::numeric_limits<float>::quiet_NaN();
  const StokesImage image = ViewFromStokes({&s0, &s1, &s2}, nullptr).stokes;
  EXPECT_TRUE(std::isinf(image.noise(2, 2)));
  EXPECT_EQ(image.s1(2, 2), 0);
  EXPECT_TRUE(std::isfinite(image.noise(1, 2)));
}

TEST(AopDop, GiveBackTheirAngleAndDegree) {
  Picture rgb{{Image<float>(8, 8, 51), Image<float>(8, 8, 102), Image<float>(8, 8, 153)}, 255, 8};
  Image<float> aop(8, 8), dop(8, 8);
  for (int i = 0; i < 64; ++i) {
    aop.pixels()[std::size_t(i)] = float(i) * 3.14159265f / 64;
    dop.pixels()[std::size_t(i)] = 0.1f + float(i) / 128;
  }
  const PolarView view = ViewFromAopDop(rgb, aop, dop, Sensor{});
  const StokesImage& s = view.stokes;
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) {
      EXPECT_NEAR(s.s0(x, y), 0.8, 1e-6);
      EXPECT_NEAR(AngleOfPolarization(s.s1(x, y), s.s2(x, y)), aop(x, y), 1e-5);
      EXPECT_NEAR(DegreeOfPolarization(s.s0(x, y), s.s1(x, y), s.s2(x, y)), dop(x, y), 1e-5);
    }
}

TEST(Photo, HasNoPolarizationAndNoInvalidPixels) {
  const Picture photo{{Image<float>(8, 8, 255)}, 255, 8};
  const PolarView view = ViewFromPhoto(photo, Sensor{});
  for (std::size_t i = 0; i < 64; ++i) {
    EXPECT_FLOAT_EQ(view.stokes.s0.pixels()[i], 2);
    EXPECT_EQ(view.stokes.s1.pixels()[i], 0);
    EXPECT_EQ(view.stokes.s2.pixels()[i], 0);
    EXPECT_TRUE(std::isfinite(view.stokes.noise.pixels()[i]));
  }
}

TEST(Mosaic, GivesTheSameBytesForAnyNumberOfThreads) {
  Sensor sensor = TwelveBits("90 45 / 135 0 rggb");
  Image<float> counts(200, 150);
  Random random(1);
  for (float& value : counts.pixels()) value = float(random.Below(4096));
  std::vector<StokesImage> results;
  for (const std::size_t threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(ViewFromMosaic(counts, sensor, Bilinear()).stokes);
  }
  for (const StokesImage& result : results) {
    EXPECT_TRUE(std::ranges::equal(result.s1.pixels(), results[0].s1.pixels()));
    EXPECT_TRUE(std::ranges::equal(result.noise.pixels(), results[0].noise.pixels()));
  }
}

std::string MessageOfCheck(const Image<float>& counts, const Sensor& sensor) {
  try {
    CheckMosaic(counts, sensor, "view-7");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(MosaicCheck, RefusesSidesThatAreNotWholeCells) {
  EXPECT_EQ(MessageOfCheck(Image<float>(6, 4, 9), TwelveBits("90 45 / 135 0")), "");
  const std::string mono = MessageOfCheck(Image<float>(7, 4, 9), TwelveBits("90 45 / 135 0")),
                    colour = MessageOfCheck(Image<float>(6, 4, 9), TwelveBits("90 45 / 135 0 rggb"));
  EXPECT_NE(mono.find("7x4 px does not consist of whole 2x2 cells: view-7"), std::string::npos) << mono;
  EXPECT_NE(colour.find("whole 4x4 cells"), std::string::npos) << colour;
}

TEST(MosaicCheck, RefusesCountsThatTheBitsCannotHold) {
  Image<float> counts(8, 8, 100);
  counts(3, 3) = 5000;
  const std::string message = MessageOfCheck(counts, TwelveBits("90 45 / 135 0"));
  EXPECT_NE(message.find("12 bits holds the count 5000: view-7"), std::string::npos) << message;
}

TEST(MosaicCheck, RefusesAFrameThatIsClippedEverywhere) {
  Image<float> counts(8, 8, 4095);
  const std::string message = MessageOfCheck(counts, TwelveBits("90 45 / 135 0"));
  EXPECT_NE(message.find("every sample of this mosaic is clipped"), std::string::npos) << message;
  counts(2, 2) = 4094;
  EXPECT_EQ(MessageOfCheck(counts, TwelveBits("90 45 / 135 0")), "");
}

struct Part {
  int x = 0, y = 0, width = 0, height = 0;
};

// Real frames whose polarization was found out from what they show (../shared/data/raw-mosaics/README.md).
class RealFrame : public testing::Test {
 protected:
  static fs::path Path(const std::string& name) {
    return fs::path(POLARSCAN_SHARED) / "data/raw-mosaics" / name;
  }
  void SetUp() override {
    if (!fs::exists(Path("README.md"))) GTEST_SKIP() << "../shared/data/raw-mosaics is not there";
  }
  // A part of the frame, which begins at whole cells.
  static StokesImage Demosaic(const std::string& name, const std::string& layout,
                              const DemosaicMethod& method = Bilinear(), Part part = {}) {
    Sensor sensor;
    sensor.layout = ParseLayout(layout);
    static std::map<std::string, Image<float>> frames;
    if (!frames.contains(name)) frames[name] = ReadPicture(Path(name)).planes[0];
    const Image<float>& frame = frames[name];
    if (part.width == 0) return ViewFromMosaic(frame, sensor, method).stokes;
    Image<float> counts(part.width, part.height);
    for (int y = 0; y < part.height; ++y)
      for (int x = 0; x < part.width; ++x) counts(x, y) = frame(part.x + x, part.y + y);
    return ViewFromMosaic(counts, sensor, method).stokes;
  }
};

std::array<double, 2> MeanAopAndDop(const StokesImage& image) {
  double s0 = 0, s1 = 0, s2 = 0;
  for (std::size_t i = 0; i < image.s0.size(); ++i)
    s0 += image.s0.pixels()[i], s1 += image.s1.pixels()[i], s2 += image.s2.pixels()[i];
  return {Degrees(AngleOfPolarization(float(s1), float(s2))), std::hypot(s1, s2) / s0};
}

TEST_F(RealFrame, LightReflectedByAPondIsHorizontallyPolarized) {
  const auto [aop, dop] = MeanAopAndDop(Demosaic("mono_imx250mzr_carps.png", "90 45 / 135 0"));
  EXPECT_NEAR(aop, 166, 1.5);
  EXPECT_NEAR(dop, 0.50, 0.02);
}

TEST_F(RealFrame, APartOfThePondReadsTheSameWithEveryMethod) {
  const Part part{1000, 800, 512, 400};
  const auto [aop, dop] =
      MeanAopAndDop(Demosaic("mono_imx250mzr_carps.png", "90 45 / 135 0", Bilinear(), part));
  for (const DemosaicMethod& method : DemosaicMethods()) {
    const auto [own_aop, own_dop] =
        MeanAopAndDop(Demosaic("mono_imx250mzr_carps.png", "90 45 / 135 0", method, part));
    EXPECT_NEAR(own_aop, aop, 0.2) << method.name;
    EXPECT_NEAR(own_dop, dop, 0.005) << method.name;
  }
}

// Round filters that stand on a window sill, labelled by hand with 90 degrees minus their AoP; places read
// off the picture. Each reads the same angle in all of its parts, up to 7 degrees off its label.
TEST_F(RealFrame, LabelledFiltersReadTheirAnglesWithEveryMethod) {
  constexpr int kFilters[4][4] = {
      {377, 1090, 90, 83}, {1000, 1097, 45, 44}, {1553, 1097, 0, 175}, {2107, 1107, 135, 135}};
  for (const DemosaicMethod& method : DemosaicMethods())
    for (const auto& [x, y, label_deg, angle_deg] : kFilters)
      for (int place = 0; place < 9; ++place) {
        const Part part{x / 2 * 2 - 90 + place % 3 * 60, y / 2 * 2 - 90 + place / 3 * 60, 60, 60};
        const double read =
            MeanAopAndDop(Demosaic("mono_imx250mzr_polarizer.png", "90 45 / 135 0", method, part))[0];
        EXPECT_LT(std::abs(std::remainder(read - label_deg, 180)), 8) << method.name;    // as placed by hand
        EXPECT_LT(std::abs(std::remainder(read - angle_deg, 180)), 1.5) << method.name;  // as they stand
      }
}

// The table mirrors at the limb of an apple: AoP = 90 degrees + azimuth of the limb's normal, anticlockwise.
// Places 30 px inside of it, where it is lit, and its azimuth there, read off the picture.
TEST_F(RealFrame, LightMirroredAtAnApplesLimbIsPolarizedAlongIt) {
  constexpr int kPlaces[5][3] = {
      {222, 728, 193}, {248, 815, 200}, {286, 896, 209}, {333, 972, 220}, {1227, 820, -25}};
  for (const DemosaicMethod& method : DemosaicMethods())
    for (const auto& [x, y, azimuth_deg] : kPlaces) {
      const Part part{x / 2 * 2 - 12, y / 2 * 2 - 12, 24, 24};
      const auto [aop, dop] =
          MeanAopAndDop(Demosaic("mono_imx250mzr_fruits.png", "90 45 / 135 0", method, part));
      EXPECT_LT(std::abs(std::remainder(aop - 90 - azimuth_deg, 180)), 9)
          << method.name << " " << azimuth_deg;
      EXPECT_GT(dop, 0.15) << method.name << " " << azimuth_deg;
    }
}

TEST_F(RealFrame, TheTableTopBeforeTheStripsIsPolarizedHorizontally) {
  for (const DemosaicMethod& method : DemosaicMethods()) {
    const auto [aop, dop] =
        MeanAopAndDop(Demosaic("mono_pfa_polarizer-fan.tif", "90 135 / 45 0", method, {1000, 1070, 700, 60}));
    EXPECT_LT(std::abs(std::remainder(aop, 180)), 2) << method.name;
    EXPECT_NEAR(dop, 0.25, 0.04) << method.name;
  }
}

// Strips of polarizer on a half circle, each along its radius: the mean vector of 2 (AoP - sense x
// direction), whose length is 1 if they agree up to the angle that it has.
std::array<double, 2> CompareStrips(const StokesImage& fan, double sense, int left = 0) {
  const double hub_x = 907 - left, hub_y = 728;  // centre of the half circle, read off the picture
  double c = 0, s = 0, n = 0;
  for (int y = 0; y < std::min(728, fan.s0.height()); ++y)
    for (int x = 0; x < fan.s0.width(); ++x) {
      const double radius = std::hypot(x - hub_x, y - hub_y);
      if (radius < 490 || radius > 620 ||
          DegreeOfPolarization(fan.s0(x, y), fan.s1(x, y), fan.s2(x, y)) < 0.5)
        continue;
      const double turn =
          2 * (AngleOfPolarization(fan.s1(x, y), fan.s2(x, y)) - sense * std::atan2(hub_y - y, x - hub_x));
      c += std::cos(turn), s += std::sin(turn), ++n;
    }
  return {std::hypot(c, s) / n, Degrees(float(std::atan2(s, c) / 2))};
}

TEST_F(RealFrame, StripsOfPolarizerHaveTheirOwnDirectionsAnticlockwise) {
  EXPECT_GT(CompareStrips(Demosaic("mono_pfa_polarizer-fan.tif", "90 135 / 45 0"), 1)[0], 0.97);
  const Part part{500, 100, 800, 200};  // the upper strips
  for (const DemosaicMethod& method : DemosaicMethods()) {
    const auto [agreement, offset] =
        CompareStrips(Demosaic("mono_pfa_polarizer-fan.tif", "90 135 / 45 0", method, part), 1, part.x);
    EXPECT_GT(agreement, 0.97) << method.name;
    EXPECT_NEAR(offset, 0, 4) << method.name;
  }
}

TEST_F(RealFrame, TheWrongOrderOfDiagonalAnglesReadsTheStripsClockwise) {
  const StokesImage wrong = Demosaic("mono_pfa_polarizer-fan.tif", "90 45 / 135 0");
  EXPECT_LT(CompareStrips(wrong, 1)[0], 0.5);
  EXPECT_GT(CompareStrips(wrong, -1)[0], 0.97);
}

}  // namespace
}  // namespace polarscan
