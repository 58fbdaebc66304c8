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
