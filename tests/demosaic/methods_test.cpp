// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "demosaic/method.h"
#include "mosaic.h"

namespace polarscan {
namespace {

using test::Stokes;

const char* const kBayers[] = {"", "rggb", "bggr", "grbg", "gbrg"};

// Smooth waves with an edge and a little noise, polarized by a fifth; the same for all colours but for its
// strength.
Image<float> TakeTexture(int width, int height, const Layout& layout, std::uint64_t seed) {
  Random random(seed);
  const double u = random.Uniform(0.05f, 0.5f), v = random.Uniform(0.05f, 0.5f), phase = random.Uniform(0, 6);
  return test::TakeMosaic(width, height, layout, [&](int x, int y, char colour) {
    const double s0 = (colour == 'r'   ? 0.9
                       : colour == 'b' ? 0.7
                                       : 0.8) +
                      0.2 * std::sin(u * x + v * y + phase) + (2 * x + y > width ? 0.15 : 0) +
                      0.003 * random.Normal();
    return Stokes{s0, 0.2 * s0, -0.1 * s0};
  });
}

TEST(DemosaicMethods, ReturnConstantLightExactlyForEveryLayout) {
  const test::Scene constant = [](int, int, char colour) { return Stokes{0.6, 0.1 * (colour != 'b'), -0.2}; };
  for (const DemosaicMethod& method : DemosaicMethods())
    for (const char* bayer : kBayers)
      for (const Layout& layout : test::AllLayouts(bayer)) {
        const auto colours = method.interpolate(test::TakeMosaic(14, 12, layout, constant), layout);
        const std::string names = *bayer ? "rgb" : "m";
        ASSERT_EQ(colours.size(), names.size());
        double largest = 0;
        for (std::size_t c = 0; c < colours.size(); ++c)
          for (std::size_t a = 0; a < 4; ++a)
            for (const float value : colours[c][a].pixels())
              largest =
                  std::max(largest, std::abs(value - test::Behind(constant(0, 0, names[c]), kAnglesDeg[a])));
        EXPECT_LT(largest, 3e-6) << method.name << " " << ToString(layout);
      }
}

TEST(DemosaicMethods, TakeAnySizeFromFourByFourOn) {
  for (const DemosaicMethod& method : DemosaicMethods())
    for (const char* bayer : {"", "grbg"})
      for (int width = 4; width < 10; ++width)
        for (int height = 4; height < 10; ++height) {
          const Layout layout = {{90, 45, 135, 0}, bayer};
          for (const AnglePlanes& planes : method.interpolate(TakeTexture(width, height, layout, 3), layout))
            for (const Image<float>& plane : planes) {
              ASSERT_EQ(plane.width(), width);
              ASSERT_EQ(plane.height(), height);
              for (const float value : plane.pixels())
                ASSERT_TRUE(value > -1 && value < 2) << method.name << bayer << width << "x" << height;
            }
        }
}

TEST(DemosaicMethods, RefuseAMosaicThatIsTooSmall) {
  for (const DemosaicMethod& method : DemosaicMethods()) {
    EXPECT_THROW(method.interpolate(Image<float>(3, 8), {}), Error) << method.name;
    EXPECT_THROW(method.interpolate({}, {}), Error) << method.name;
  }
}

// A change of the picture: where pixel (x, y) goes, and what becomes of an angle.
struct Motion {
  std::function<std::array<int, 2>(int x, int y, int width, int height)> place;
  std::function<int(int angle)> angle;
  bool turns;
};

// What a method makes of the moved mosaic against the moved result: the largest difference.
double MotionError(const DemosaicMethod& method, const Layout& layout, const Motion& motion) {
  const int width = 40, height = 36;
  const Image<float> mosaic = TakeTexture(width, height, layout, 5);
  Image<float> moved(motion.turns ? height : width, motion.turns ? width : height);
  Layout moved_layout;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto [u, v] = motion.place(x, y, width, height);
      moved(u, v) = mosaic(x, y);
      moved_layout.angles_deg[std::size_t((v & 1) * 2 + (u & 1))] = motion.angle(layout.AngleAt(x, y));
    }
  const AnglePlanes planes = method.interpolate(mosaic, layout)[0],
                    moved_planes = method.interpolate(moved, moved_layout)[0];
  double largest = 0;
  for (std::size_t a = 0; a < 4; ++a)
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const auto [u, v] = motion.place(x, y, width, height);
        const std::size_t moved_angle = std::size_t(motion.angle(kAnglesDeg[a]) / 45);
        largest = std::max(largest, std::abs(double(planes[a](x, y)) - moved_planes[moved_angle](u, v)));
      }
  return largest;
}

TEST(DemosaicMethods, TurningThePictureByARightAngleTurnsThePolarizationByOne) {
  const Motion anticlockwise = {[](int x, int y, int width, int) {
                                  return std::array{y, width - 1 - x};
                                },
                                [](int angle) { return (angle + 90) % 180; }, true};
  for (const DemosaicMethod& method : DemosaicMethods())
    for (const Layout& layout : test::AllLayouts(""))
      EXPECT_LT(MotionError(method, layout, anticlockwise), 1e-4) << method.name << " " << ToString(layout);
}

TEST(DemosaicMethods, MirroringThePictureMirrorsThePolarization) {
  const auto mirrored = [](int angle) { return (180 - angle) % 180; };
  const Motion across = {[](int x, int y, int width, int) {
                           return std::array{width - 1 - x, y};
                         },
                         mirrored, false};
  const Motion down = {[](int x, int y, int, int height) {
                         return std::array{x, height - 1 - y};
                       },
                       mirrored, false};
  for (const DemosaicMethod& method : DemosaicMethods())
    for (const Layout& layout : test::AllLayouts("")) {
      EXPECT_LT(MotionError(method, layout, across), 1e-4) << method.name << " " << ToString(layout);
      EXPECT_LT(MotionError(method, layout, down), 1e-4) << method.name << " " << ToString(layout);
    }
}

// Superpixels begin at the crop's first pixel, so they are others.
TEST(DemosaicMethods, ACropAtAnOddPixelIsAMosaicOfTheShiftedLayout) {
  const int size = 80, margin = 30;
  const Layout layout = ParseLayout("90 45 / 135 0");
  const Image<float> mosaic = TakeTexture(size, size, layout, 9);
  for (const DemosaicMethod& method : DemosaicMethods()) {
    if (method.name == "superpixel") continue;
    const AnglePlanes whole = method.interpolate(mosaic, layout)[0];
    for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {1, 1}}) {
      Image<float> crop(size - dx, size - dy);
      Layout shifted;
      for (int y = 0; y < crop.height(); ++y)
        for (int x = 0; x < crop.width(); ++x) crop(x, y) = mosaic(x + dx, y + dy);
      for (int i = 0; i < 4; ++i)
        shifted.angles_deg[std::size_t(i)] = layout.AngleAt((i & 1) + dx, (i >> 1) + dy);
      const AnglePlanes part = method.interpolate(crop, shifted)[0];
      for (std::size_t a = 0; a < 4; ++a)
        for (int y = margin; y < size - margin; ++y)
          for (int x = margin; x < size - margin; ++x)
            ASSERT_NEAR(part[a](x, y), whole[a](x + dx, y + dy), 1e-5) << method.name << dx << dy;
    }
  }
}

// sd(S0), and rms of sd(S1), sd(S2) over sqrt(2), in units of the samples' noise, on even light.
std::array<double, 2> NoiseGains(const DemosaicMethod& method, const Layout& layout) {
  const int size = 200, border = 24;
  const double sigma = 0.004;
  const Stokes light = {1, 0.2, -0.1};
  Random random(7);
  Image<float> mosaic = test::TakeMosaic(size, size, layout, [&](int, int, char) { return light; });
  for (float& sample : mosaic.pixels()) sample += float(sigma * random.Normal());
  const auto colours = method.interpolate(mosaic, layout);
  double intensity = 0, polarization = 0, count = 0;
  for (int y = border; y < size - border; ++y)
    for (int x = border; x < size - border; ++x) {
      double s0 = 0, s1 = 0, s2 = 0;
      for (const auto& [i0, i45, i90, i135] : colours) {
        s0 += (i0(x, y) + i45(x, y) + i90(x, y) + i135(x, y)) / 2 / double(colours.size());
        s1 += (i0(x, y) - i90(x, y)) / double(colours.size());
        s2 += (i45(x, y) - i135(x, y)) / double(colours.size());
      }
      intensity += std::pow(s0 - light.s0, 2), ++count;
      polarization += (std::pow(s1 - light.s1, 2) + std::pow(s2 - light.s2, 2)) / 2;
    }
  return {std::sqrt(intensity / count) / sigma, std::sqrt(polarization / count / 2) / sigma};
}

// 23000 pixels whose errors hang together: 2 %.
TEST(DemosaicMethods, StateHowMuchOfTheNoiseTheyKeep) {
  for (const DemosaicMethod& method : DemosaicMethods())
    for (const char* bayer : kBayers) {
      const Layout layout = {{90, 45, 135, 0}, bayer};
      const auto [s0, polarization] = NoiseGains(method, layout);
      EXPECT_NEAR(method.NoiseGain(layout) / polarization, 1, 0.03) << method.name << bayer << polarization;
      const double stated = *bayer ? method.s0_noise_colour : method.s0_noise_mono;
      EXPECT_NEAR(stated / s0, 1, 0.03) << method.name << bayer << s0;
    }
}

TEST(DemosaicMethods, KeepAboutTheSameShareOfTheNoiseForEveryLayout) {
  for (const DemosaicMethod& method : DemosaicMethods())
    for (const char* layout : {"0 90 / 45 135", "0 45 / 90 135"})
      EXPECT_NEAR(NoiseGains(method, ParseLayout(layout))[1] / method.noise_mono, 1, 0.25)
          << method.name << layout;
}

// The farthest pixel that a change of one sample changes by more than a fiftieth of it.
TEST(DemosaicMethods, StateHowFarTheyLook) {
  const int size = 72, middle = size / 2 - 2;
  const float change = 0.3f;
  for (const DemosaicMethod& method : DemosaicMethods())
    for (const char* bayer : {"", "rggb"}) {
      const Layout layout = {{90, 45, 135, 0}, bayer};
      int farthest = 0;
      for (int phase = 0; phase < 16; ++phase) {
        Image<float> mosaic = TakeTexture(size, size, layout, std::uint64_t(phase));
        const auto before = method.interpolate(mosaic, layout);
        const int u = middle + phase % 4, v = middle + phase / 4;
        mosaic(u, v) += change;
        const auto after = method.interpolate(mosaic, layout);
        for (std::size_t c = 0; c < before.size(); ++c)
          for (std::size_t a = 0; a < 4; ++a)
            for (int y = 0; y < size; ++y)
              for (int x = 0; x < size; ++x)
                if (std::abs(after[c][a](x, y) - before[c][a](x, y)) > change / 50)
                  farthest = std::max({farthest, std::abs(x - u), std::abs(y - v)});
      }
      EXPECT_LE(farthest, method.Reach(layout)) << method.name << bayer;
      EXPECT_GE(farthest, method.Reach(layout) - 2) << method.name << bayer;
    }
}

TEST(DemosaicMethods, AnUnknownNameIsAnErrorThatListsTheKnownOnes) {
  try {
    FindDemosaicMethod("magic");
    ADD_FAILURE();
  } catch (const Error& error) {
    for (const DemosaicMethod& method : DemosaicMethods())
      EXPECT_NE(std::string(error.what()).find(method.name), std::string::npos);
  }
}

}  // namespace
}  // namespace polarscan
