// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <map>
#include <numbers>

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

// What rapidcheck draws.
Layout AnyLayout(const std::string& bayer) {
  const std::vector<Layout> layouts = test::AllLayouts(bayer);
  return layouts[*rc::gen::inRange<std::size_t>(0, layouts.size()).as("which of the 24 layouts")];
}

std::string AnyBayer() { return kBayers[*rc::gen::inRange(1, 5).as("which Bayer order")]; }

int AnySide(int least, int most, int step = 1) {
  return least + step * *rc::gen::inRange(0, (most - least) / step + 1).as("side");
}

Stokes AnyLight() {
  const double s0 = *rc::gen::inRange(1, 201).as("S0, percent") / 100.0,
               dop = *rc::gen::inRange(0, 101).as("DoP, percent") / 100.0,
               turn = *rc::gen::inRange(0, 180).as("AoP, degrees") * std::numbers::pi / 90;
  return {s0, s0 * dop * std::cos(turn), s0 * dop * std::sin(turn)};
}

TEST(DemosaicMethods, ReturnConstantLightExactlyForEveryLayoutAndSize) {
  for (const DemosaicMethod& method : DemosaicMethods())
    for (const char* bayer : kBayers)
      EXPECT_TRUE(rc::check(fmt::format("{} {}", method.name, bayer), [&] {
        const std::string names = *bayer ? "rgb" : "m";
        const Layout layout = AnyLayout(bayer);
        const int width = AnySide(4, 24), height = AnySide(4, 24);
        std::map<char, Stokes> light;
        for (const char name : names) light[name] = AnyLight();
        const auto colours = method.interpolate(
            test::TakeMosaic(width, height, layout, [&](int, int, char colour) { return light[colour]; }),
            layout);
        RC_ASSERT(colours.size() == names.size());
        double largest = 0;
        for (std::size_t c = 0; c < colours.size(); ++c)
          for (std::size_t a = 0; a < 4; ++a)
            for (const float value : colours[c][a].pixels())
              largest = std::max(largest, std::abs(value - test::Behind(light[names[c]], kAnglesDeg[a])));
        RC_ASSERT(colours[0][0].width() == width && colours[0][0].height() == height);
        RC_ASSERT(largest < 5e-6);
      }));
}

TEST(DemosaicMethods, TakeAnySizeFromFourByFourOn) {
  for (const DemosaicMethod& method : DemosaicMethods())
    for (const char* bayer : {"", "grbg"})
      EXPECT_TRUE(rc::check(fmt::format("{} {}", method.name, bayer), [&] {
        const Layout layout = AnyLayout(bayer);
        const int width = AnySide(4, 40), height = AnySide(4, 40);
        for (const AnglePlanes& planes : method.interpolate(TakeTexture(width, height, layout, 3), layout))
          for (const Image<float>& plane : planes) {
            RC_ASSERT(plane.width() == width && plane.height() == height);
            for (const float value : plane.pixels()) RC_ASSERT(value > -1 && value < 2);
          }
      }));
}

TEST(DemosaicMethods, RefuseAMosaicThatIsTooSmall) {
  for (const DemosaicMethod& method : DemosaicMethods()) {
    EXPECT_THROW(method.interpolate(Image<float>(3, 8), {}), Error) << method.name;
    EXPECT_THROW(method.interpolate({}, {}), Error) << method.name;
  }
}

// S0, S1, S2 of the first colour.
std::array<Image<float>, 3> StokesOf(const DemosaicMethod& method, const Image<float>& mosaic,
                                     const Layout& layout) {
  const auto [i0, i45, i90, i135] = method.interpolate(mosaic, layout)[0];
  std::array<Image<float>, 3> stokes{i0, i0, i45};
  for (std::size_t i = 0; i < i0.size(); ++i) {
    stokes[0].pixels()[i] = (i0.pixels()[i] + i45.pixels()[i] + i90.pixels()[i] + i135.pixels()[i]) / 2;
    stokes[1].pixels()[i] -= i90.pixels()[i];
    stokes[2].pixels()[i] -= i135.pixels()[i];
  }
  return stokes;
}

// A change of the picture: where pixel (x, y) goes, and what becomes of an angle, of S1 and of S2
// (docs/conventions.md).
struct Motion {
  std::function<std::array<int, 2>(int x, int y, int width, int height)> place;
  std::function<int(int angle)> angle;
  int s1_sign, s2_sign;
};

// What a method makes of the moved mosaic of any layout against the moved result. Rounding alone makes 2e-4
// in colour pictures 4 px wide, whose windows hardly vary.
void CheckMotion(const DemosaicMethod& method, bool colour, const Motion& motion) {
  const int step = colour ? 4 : method.name == "superpixel" ? 2 : 1;  // whole cells
  const Layout layout = AnyLayout(colour ? AnyBayer() : "");
  const int width = AnySide(4, 40, step), height = AnySide(4, 40, step);
  const Image<float> mosaic =
      TakeTexture(width, height, layout, *rc::gen::inRange(0, 1000).as("seed of the texture"));
  const auto [corner_x, corner_y] = motion.place(width - 1, height - 1, width, height);
  const auto [first_x, first_y] = motion.place(0, 0, width, height);
  Image<float> moved(std::max(corner_x, first_x) + 1, std::max(corner_y, first_y) + 1);
  Layout moved_layout = layout;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto [u, v] = motion.place(x, y, width, height);
      moved(u, v) = mosaic(x, y);
      moved_layout.angles_deg[std::size_t((v & 1) * 2 + (u & 1))] = motion.angle(layout.AngleAt(x, y));
      if (colour) moved_layout.bayer[std::size_t((v >> 1 & 1) * 2 + (u >> 1 & 1))] = layout.ColourAt(x, y);
    }
  const auto before = StokesOf(method, mosaic, layout), after = StokesOf(method, moved, moved_layout);
  const float signs[] = {1, float(motion.s1_sign), float(motion.s2_sign)};
  for (std::size_t i = 0; i < 3; ++i)
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const auto [u, v] = motion.place(x, y, width, height);
        RC_ASSERT(std::abs(after[i](u, v) - signs[i] * before[i](x, y)) < 5e-4);
      }
}

void ExpectMotion(const std::string& name, const Motion& motion) {
  for (const DemosaicMethod& method : DemosaicMethods())
    for (const bool colour : {false, true})
      EXPECT_TRUE(rc::check(fmt::format("{} {}{}", name, method.name, colour ? ", colour" : ""),
                            [&] { CheckMotion(method, colour, motion); }));
}

TEST(DemosaicMethods, TurningThePictureByARightAngleTurnsThePolarizationByOne) {
  ExpectMotion("turned", {[](int x, int y, int width, int) {
                            return std::array{y, width - 1 - x};
                          },
                          [](int angle) { return (angle + 90) % 180; }, -1, -1});
}

TEST(DemosaicMethods, MirroringThePictureMirrorsThePolarization) {
  const auto mirrored = [](int angle) { return (180 - angle) % 180; };
  ExpectMotion("left to right", {[](int x, int y, int width, int) {
                                   return std::array{width - 1 - x, y};
                                 },
                                 mirrored, 1, -1});
  ExpectMotion("upside down", {[](int x, int y, int, int height) {
                                 return std::array{x, height - 1 - y};
                               },
                               mirrored, 1, -1});
}

// Superpixels begin at the crop's first pixel, so they are others.
TEST(DemosaicMethods, ACropAtAnOddPixelIsAMosaicOfTheShiftedLayout) {
  const int size = 80, margin = 30;
  for (const DemosaicMethod& method : DemosaicMethods()) {
    if (method.name == "superpixel") continue;
    EXPECT_TRUE(rc::check(method.name, [&] {
      const Layout layout = AnyLayout("");
      const Image<float> mosaic = TakeTexture(size, size, layout, 9);
      const int dx = *rc::gen::inRange(0, 4).as("dx"), dy = *rc::gen::inRange(0, 4).as("dy");
      Image<float> crop(size - dx, size - dy);
      Layout shifted;
      for (int y = 0; y < crop.height(); ++y)
        for (int x = 0; x < crop.width(); ++x) crop(x, y) = mosaic(x + dx, y + dy);
      for (int i = 0; i < 4; ++i)
        shifted.angles_deg[std::size_t(i)] = layout.AngleAt((i & 1) + dx, (i >> 1) + dy);
      const auto whole = StokesOf(method, mosaic, layout), part = StokesOf(method, crop, shifted);
      for (std::size_t i = 0; i < 3; ++i)
        for (int y = margin; y < size - margin; ++y)
          for (int x = margin; x < size - margin; ++x)
            RC_ASSERT(std::abs(part[i](x, y) - whole[i](x + dx, y + dy)) < 1e-5);
    }));
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
