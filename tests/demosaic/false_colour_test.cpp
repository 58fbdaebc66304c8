// SPDX-License-Identifier: Apache-2.0
#include "demosaic/false_colour.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace polarscan {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

void ExpectNear(const Rgb8& a, const Rgb8& b, int tolerance) {
  EXPECT_NEAR(a.r, b.r, tolerance);
  EXPECT_NEAR(a.g, b.g, tolerance);
  EXPECT_NEAR(a.b, b.b, tolerance);
}

// One pixel of light that is polarized along `aop`.
StokesImage Pixel(float s0, float dop, float aop, float noise = 0) {
  return {Image<float>(1, 1, s0), Image<float>(1, 1, s0 * dop * std::cos(2 * aop)),
          Image<float>(1, 1, s0 * dop * std::sin(2 * aop)), Image<float>(1, 1, noise)};
}

TEST(FalseColour, AopColoursAreRedAtZeroAndCyanAtNinetyDegrees) {
  ExpectNear(AopColour(0), {255, 0, 0}, 0);
  ExpectNear(AopColour(kPi / 2), {0, 255, 255}, 1);
  ExpectNear(AopColour(kPi / 4), {128, 255, 0}, 1);      // hue 90
  ExpectNear(AopColour(3 * kPi / 4), {128, 0, 255}, 1);  // hue 270
  ExpectNear(AopColour(kPi / 3), {0, 255, 0}, 1);        // hue 120
}

TEST(FalseColour, AopColoursRepeatEveryHalfTurn) {
  for (float angle = 0; angle < kPi; angle += 0.1f) {
    ExpectNear(AopColour(angle), AopColour(angle + kPi), 1);
    ExpectNear(AopColour(angle), AopColour(angle - 3 * kPi), 1);
  }
  ExpectNear(AopColour(kPi - 1e-4f), AopColour(1e-4f), 1);
}

TEST(FalseColour, ValueOfTheAopPictureIsTheRootOfTheDegreeOfPolarization) {
  ExpectNear(AopPicture(Pixel(2, 1, 0), 1)(0, 0), {255, 0, 0}, 1);
  ExpectNear(AopPicture(Pixel(2, 0.1f, 0), 0.4f)(0, 0), {128, 0, 0}, 1);
  ExpectNear(AopPicture(Pixel(0.3f, 0.8f, kPi / 2), 0.4f)(0, 0), {0, 255, 255}, 1);
  ExpectNear(AopPicture(Pixel(1, 0, 0.3f), 1)(0, 0), {0, 0, 0}, 0);
}

// Light with its field along the direction (right, up) = (cos a, sin a) is painted with the wheel's colour
// there.
TEST(FalseColour, WheelShowsEachDirectionInTheColourOfItsAop) {
  const int size = 201;
  const Image<Rgb8> wheel = AopWheel(size);
  for (int degrees = 0; degrees < 360; degrees += 15) {
    const float a = float(degrees) * kPi / 180, r = 0.97f * size / 2;
    const int x = int(size / 2.f + r * std::cos(a)), y = int(size / 2.f - r * std::sin(a));
    ExpectNear(wheel(x, y), AopPicture(Pixel(1, 0.97f, a), 1)(0, 0), 8);
  }
  EXPECT_EQ(wheel(size / 2, size / 2), (Rgb8{0, 0, 0}));
  EXPECT_EQ(wheel(0, 0), kNoData);
}

TEST(FalseColour, PixelsWithoutAValueAreNeutralGrey) {
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(AopPicture(Pixel(1, 0.5f, 1, infinity))(0, 0), kNoData);
  EXPECT_EQ(DopPicture(Pixel(1, 0.5f, 1, infinity))(0, 0), kNoData);
  EXPECT_EQ(DopPicture(Pixel(0, 0, 0))(0, 0), kNoData);
  EXPECT_EQ(DepthPicture(Image<float>(1, 1, 0.f), 1, 2)(0, 0), kNoData);
  EXPECT_EQ(NormalPicture(Image<Eigen::Vector3f>(1, 1, Eigen::Vector3f::Zero()))(0, 0), kNoData);
}

// OKLab by its published definition, from 8-bit sRGB.
std::array<double, 3> ToOklab(const Rgb8& colour) {
  const auto light = [](std::uint8_t byte) {
    const double c = byte / 255.0;
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  };
  const double r = light(colour.r), g = light(colour.g), b = light(colour.b);
  const double l = std::cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b),
               m = std::cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b),
               s = std::cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return {0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s,
          1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s,
          0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s};
}

TEST(FalseColour, EvenMapStepsEquallyFarAndIsEquallyLightForEveryAngle) {
  const float step = kPi / 36;
  for (float aop = 0; aop < kPi; aop += step) {
    const auto here = ToOklab(AopColour(aop, 1, AopMap::kEven)),
               next = ToOklab(AopColour(aop + step, 1, AopMap::kEven));
    EXPECT_NEAR(here[0], 0.74, 0.005) << aop;
    const double apart = std::hypot(next[1] - here[1], next[2] - here[2]);
    EXPECT_NEAR(apart, 0.12 * 2 * step, 0.0035) << aop;  // 8 bits
  }
  ExpectNear(AopColour(0.3f, 1, AopMap::kEven), AopColour(0.3f + kPi, 1, AopMap::kEven), 1);
  EXPECT_EQ(AopColour(1, 0, AopMap::kEven), (Rgb8{0, 0, 0}));
}

TEST(FalseColour, DiffuseAndSpecularLightAreWhatATurningPolarizerLeavesAndTakes) {
  const auto grey = [](float light) { return int(std::lround(255 * std::pow(light, 1 / 2.2f))); };
  const StokesImage half = Pixel(0.8f, 0.5f, 1);  // Imax 0.6, Imin 0.2
  ExpectNear(S0Picture(half, 2)(0, 0),
             Rgb8{std::uint8_t(grey(0.4f)), std::uint8_t(grey(0.4f)), std::uint8_t(grey(0.4f))}, 1);
  EXPECT_NEAR(DiffusePicture(half, 2)(0, 0).g, grey(0.2f), 1);   // 2 Imin / 2
  EXPECT_NEAR(SpecularPicture(half, 2)(0, 0).g, grey(0.4f), 1);  // 2 (Imax - Imin) / 2
}

TEST(FalseColour, RedundancyIsShownInUnitsOfItsNoise) {
  const StokesImage view = Pixel(1, 0.2f, 1, 0.01f);
  EXPECT_EQ(RedundancyPicture(view, Image<float>(1, 1, 0.f), 5)(0, 0), HeatPalette()[0]);
  EXPECT_EQ(RedundancyPicture(view, Image<float>(1, 1, -0.1f), 5)(0, 0), HeatPalette()[255]);
  EXPECT_EQ(RedundancyPicture(view, Image<float>(1, 1, 0.05f), 5)(0, 0), HeatPalette()[128]);
}

TEST(FalseColour, TheLegendCoversTheBottomRightCornerAlone) {
  Image<Rgb8> picture(30, 20, Rgb8{1, 2, 3});
  DrawLegend(AopWheel(9), picture);
  EXPECT_EQ(picture(29 - 4, 19 - 4), (Rgb8{0, 0, 0}));  // the wheel's middle
  EXPECT_EQ(picture(29, 19), (Rgb8{1, 2, 3}));          // beside the disc
  EXPECT_EQ(picture(10, 10), (Rgb8{1, 2, 3}));
  Image<Rgb8> small(4, 4);
  DrawLegend(AopWheel(9), small);  // larger than the picture
  EXPECT_EQ(small.width(), 4);
}

TEST(FalseColour, PalettesGrowLighterAllTheWay) {
  const auto luma = [](const Rgb8& c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; };
  for (const Palette& palette : {HeatPalette(), RampPalette()})
    for (std::size_t i = 1; i < palette.size(); ++i)
      EXPECT_GE(luma(palette[i]) + 0.8, luma(palette[i - 1])) << i;
  EXPECT_EQ(HeatPalette()[255], (Rgb8{0xfc, 0xff, 0xa4}));
  EXPECT_EQ(RampPalette()[0], (Rgb8{0x44, 0x01, 0x54}));
}

TEST(FalseColour, NearDepthIsYellowAndFarDepthIsPurple) {
  Image<float> depth(3, 1);
  depth(0, 0) = 2;
  depth(1, 0) = 6;
  depth(2, 0) = 100;
  const Image<Rgb8> picture = DepthPicture(depth, 2, 6);
  EXPECT_EQ(picture(0, 0), RampPalette()[255]);
  EXPECT_EQ(picture(1, 0), RampPalette()[0]);
  EXPECT_EQ(picture(2, 0), RampPalette()[0]);
}

TEST(FalseColour, ANormalThatFacesTheCameraIsLightBlue) {
  ExpectNear(NormalColour({0, 0, -1}), {128, 128, 255}, 1);
  ExpectNear(NormalColour({1, 0, 0}), {255, 128, 128}, 1);   // to the right
  ExpectNear(NormalColour({0, -1, 0}), {128, 255, 128}, 1);  // upwards: image y points down
}

TEST(FalseColour, TheNormalBallShowsUpperNormalsAtTheTop) {
  const Image<Rgb8> ball = NormalBall(101);
  ExpectNear(ball(50, 50), {128, 128, 255}, 2);
  const float rim = 1 - 3.f / 101,
              depth = std::sqrt(1 - rim * rim);  // the centre of pixel 1, from the middle
  ExpectNear(ball(50, 1), NormalColour({0, -rim, -depth}), 1);
  ExpectNear(ball(99, 50), NormalColour({rim, 0, -depth}), 1);
}

}  // namespace
}  // namespace polarscan
