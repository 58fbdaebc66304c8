// SPDX-License-Identifier: Apache-2.0
#include "acquisition/live_picture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "demosaic/sensor/pixel_format.h"

namespace polarscan {
namespace {

constexpr int kSize = 64;

constexpr double kBlack = 95;

Sensor TwelveBits(const std::string& layout) {
  Sensor sensor;
  sensor.layout = ParseLayout(layout);
  sensor.bits = 12, sensor.black_dn = kBlack, sensor.white_dn = 4095;
  return sensor;
}

// A Mono12 frame whose cells all see I(angle).
template <class Intensity>
Frame UniformFrame(const Layout& layout, const Intensity& intensity) {
  Image<std::uint16_t> counts(kSize, kSize);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) counts(x, y) = std::uint16_t(intensity(layout.AngleAt(x, y)));
  Frame frame;
  frame.info.pixel_format = "Mono12";
  frame.info.width = frame.info.height = kSize;
  frame.payload = Pack(ParsePixelFormat("Mono12"), counts);
  return frame;
}

TEST(LivePicture, StokesOfLightThatMalusLawDescribes) {
  const double s0 = 2000, dop = 0.4, aop = 0.3;
  for (const char* layout : {"90 45 / 135 0", "0 45 / 135 90"}) {
    const Frame frame = UniformFrame(ParseLayout(layout), [&](int angle) {
      return std::lround(kBlack + 0.5 * s0 * (1 + dop * std::cos(2 * (angle * M_PI / 180 - aop))));
    });
    const LivePicture view = LookAt(frame, TwelveBits(layout), 16);
    ASSERT_EQ(view.stokes.s0.width(), 16);
    EXPECT_NEAR(view.stokes.s0(3, 5), s0 / 4000, 2e-3);
    EXPECT_NEAR(view.stokes.s1(3, 5), dop * s0 / 4000 * std::cos(2 * aop), 1e-3);
    EXPECT_NEAR(view.stokes.s2(3, 5), dop * s0 / 4000 * std::sin(2 * aop), 1e-3);
    EXPECT_NEAR(view.level, 0.5 * s0 / 4000, 1e-3);
    EXPECT_NEAR(view.sharpness, 0, 1e-9);
  }
}

TEST(LivePicture, ClippedSharesGoToTheirPolarizerAndAreSaid) {
  const Sensor sensor = TwelveBits("90 45 / 135 0");
  const LivePicture view =
      LookAt(UniformFrame(sensor.layout, [](int angle) { return angle == 45 ? 4095 : 1000; }), sensor, 16);
  EXPECT_TRUE(std::isinf(view.stokes.noise(3, 3)));
  EXPECT_EQ(view.clipped, (std::array<double, 4>{0, 1, 0, 0}));
  EXPECT_TRUE(Advice(view).contains("clipped"));
  EXPECT_FALSE(Advice(view).contains("dark"));
}

// Light of all levels behind 45 degrees, whose samples end at `full` as far as the noise after the cut lets
// them; a third of it is beyond that.
Frame OverexposedFrame(double full, double noise_before, double noise_after) {
  constexpr int kSide = 256;
  Image<std::uint16_t> counts(kSide, kSide);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      Random random(3, std::uint64_t(x), std::uint64_t(y));
      const double light = kBlack + 1.5 * (full - kBlack) * random.Uniform();
      const double cut = std::min(full, light + noise_before * random.Normal());
      counts(x, y) = std::uint16_t(std::lround(std::clamp(cut + noise_after * random.Normal(), 0.0, 4095.0)));
    }
  Frame frame;
  frame.info.pixel_format = "Mono12";
  frame.info.width = frame.info.height = kSide;
  frame.payload = Pack(ParsePixelFormat("Mono12"), counts);
  return frame;
}

TEST(LivePicture, APileUpAtTheTopIsSaturationWhereverItLies) {
  const Sensor sensor = TwelveBits("90 45 / 135 0");
  for (const double full : {4095.0, 4094.0, 4000.0, 3995.0, 3500.0, 2047.0, 1023.0})
    for (const double noise : {0.0, 20.0}) {
      const LivePicture view = LookAt(OverexposedFrame(full, noise, 0), sensor, 16);
      for (const double share : view.clipped) EXPECT_NEAR(share, 1 / 3.0, 0.03) << full << " " << noise;
      EXPECT_TRUE(Advice(view).contains("clipped"));
    }
  // Each pixel has a full well of its own, or noise comes after it: within the last tenth.
  for (const double full : {4000.0, 3950.0}) {
    const LivePicture view = LookAt(OverexposedFrame(full, 20, 30), sensor, 16);
    for (const double share : view.clipped) EXPECT_NEAR(share, 1 / 3.0, 0.06) << full;
  }
}

TEST(LivePicture, APictureThatIsSaturatedAllOverIsSaidToBe) {
  const Sensor sensor = TwelveBits("90 45 / 135 0");
  for (const double full : {4095.0, 4000.0, 2047.0}) {
    const LivePicture view = LookAt(UniformFrame(sensor.layout, [&](int) { return int(full); }), sensor, 16);
    EXPECT_EQ(view.clipped, (std::array<double, 4>{1, 1, 1, 1})) << full;
  }
  EXPECT_TRUE(Advice(LookAt(UniformFrame(sensor.layout, [](int angle) { return 3900 + angle; }), sensor, 16))
                  .contains("clipped"));
}

// An evenly lit wall: a peak of the histogram with nothing above it, which is its light.
TEST(LivePicture, AnEvenBrightPictureIsNotTakenAsSaturated) {
  for (const double level : {700.0, 1500.0, 3000.0, 3600.0}) {
    Image<std::uint16_t> counts(256, 256);
    for (int y = 0; y < 256; ++y)
      for (int x = 0; x < 256; ++x)
        counts(x, y) = std::uint16_t(std::lround(
            level + std::sqrt(level / 3) * Random(4, std::uint64_t(x), std::uint64_t(y)).Normal()));
    Frame frame;
    frame.info.pixel_format = "Mono12";
    frame.info.width = frame.info.height = 256;
    frame.payload = Pack(ParsePixelFormat("Mono12"), counts);
    const LivePicture view = LookAt(frame, TwelveBits("90 45 / 135 0"), 16);
    EXPECT_EQ(view.clipped, (std::array<double, 4>{0, 0, 0, 0})) << level;
  }
}

TEST(LivePicture, ADarkPictureIsSaid) {
  const Sensor sensor = TwelveBits("90 45 / 135 0");
  const Frame frame = UniformFrame(sensor.layout, [](int) { return 120; });
  EXPECT_TRUE(Advice(LookAt(frame, sensor, 16)).contains("dark"));
}

// A sine wave of S0 with a period of n cells: its Laplacian is (2 - 2 cos(2 pi / n)) times itself.
TEST(LivePicture, SharpnessOfASineWave) {
  constexpr int kPeriod = 8;
  Image<std::uint16_t> counts(kSize, kSize);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      counts(x, y) = std::uint16_t(std::lround(2000 + 1000 * std::sin(2 * M_PI * (x / 2) / kPeriod)));
  Frame frame;
  frame.info.pixel_format = "Mono12";
  frame.info.width = frame.info.height = kSize;
  frame.payload = Pack(ParsePixelFormat("Mono12"), counts);
  const double factor = 2 - 2 * std::cos(2 * M_PI / kPeriod);
  const double expected =
      1000 * factor * factor * 0.5 * 1000 * 1000 / ((2000.0 - kBlack) * (2000 - kBlack) + 0.5 * 1000 * 1000);
  EXPECT_NEAR(LookAt(frame, TwelveBits("90 45 / 135 0"), 16).sharpness, expected, 0.05 * expected);
}

}  // namespace
}  // namespace polarscan
