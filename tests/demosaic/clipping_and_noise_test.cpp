// SPDX-License-Identifier: Apache-2.0
// What clipped samples and noise do to the Stokes vectors of a view, and what the view says of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "demosaic/sensor/noise.h"
#include "mosaic.h"
#include "twelve_bits.h"

namespace polarscan {
namespace {

using test::Bilinear;
using test::Stokes;
using test::ToCounts;
using test::TwelveBits;

// Two clipped samples of a cell spoil exactly the pixels whose value depends on them.
void ExpectInvalidAround(const std::string& layout, int reach) {
  const Sensor sensor = TwelveBits(layout);
  Image<float> counts(24, 24, 1000);
  counts(10, 10) = counts(11, 11) = 4095;
  const StokesImage image = ViewFromMosaic(counts, sensor, Bilinear()).stokes;
  for (int y = 0; y < 24; ++y)
    for (int x = 0; x < 24; ++x) {
      const bool near = std::max(std::abs(x - 10), std::abs(y - 10)) <= reach ||
                        std::max(std::abs(x - 11), std::abs(y - 11)) <= reach;
      EXPECT_EQ(std::isinf(image.noise(x, y)), near) << x << " " << y;
      EXPECT_TRUE(std::isfinite(image.s0(x, y)));
    }
}

TEST(Mosaic, ClippedSamplesMakeTheirSurroundingsInvalid) {
  ExpectInvalidAround("90 45 / 135 0", 1);
  ExpectInvalidAround("90 45 / 135 0 rggb", 3);
}

// One clipped sample of a cell follows from the other three: the Stokes vector is right, though that of the
// clipped counts is far off, and the noise around it is raised.
TEST(Mosaic, AClippedSampleAloneInItsCellIsRecoveredWithMoreNoise) {
  for (const char* layout : {"90 45 / 135 0", "0 45 / 135 90", "90 45 / 135 0 rggb"}) {
    Sensor sensor = TwelveBits(layout);
    sensor.dn_per_e = 0.4;
    const test::Scene bright = [](int x, int y, char) {  // I0 = 1.25 of full scale in the middle
      return x >= 8 && x < 20 && y >= 8 && y < 20 ? Stokes{1.4, 1.1, 0.2} : Stokes{1.0, 0.3, 0.2};
    };
    const StokesImage image =
        ViewFromMosaic(ToCounts(test::TakeMosaic(28, 28, sensor.layout, bright), sensor), sensor, Bilinear())
            .stokes;
    EXPECT_NEAR(image.s1(14, 14), 1.1, 2e-3) << layout;
    EXPECT_NEAR(image.s2(14, 14), 0.2, 2e-3) << layout;
    EXPECT_NEAR(image.s0(14, 14), 1.4, 2e-3) << layout;
    const double gain = Bilinear().NoiseGain(sensor.layout);
    EXPECT_NEAR(image.noise(14, 14), std::sqrt(3) * gain * SensorNoise(sensor).Sigma(0.7f), 1e-5);
    EXPECT_NEAR(image.noise(2, 2), gain * SensorNoise(sensor).Sigma(0.5f), 1e-5);
  }
}

// Half of the samples of bright light of any angle: two may be clipped at once, then nothing can be
// recovered.
TEST(Mosaic, WhatIsRecoveredIsRightWhateverTheAngle) {
  const Sensor sensor = TwelveBits("90 45 / 135 0");
  int recovered = 0;
  for (int aop = 0; aop < 180; aop += 5) {
    const double turn = 2 * aop * 3.14159265358979 / 180;
    const test::Scene scene = [&](int, int, char) {
      return Stokes{1.5, 0.6 * std::cos(turn), 0.6 * std::sin(turn)};
    };
    const StokesImage image =
        ViewFromMosaic(ToCounts(test::TakeMosaic(8, 8, sensor.layout, scene), sensor), sensor, Bilinear())
            .stokes;
    if (std::isinf(image.noise(4, 4))) continue;
    ++recovered;
    EXPECT_NEAR(image.s1(4, 4), 0.6 * std::cos(turn), 2e-3) << aop;
    EXPECT_NEAR(image.s2(4, 4), 0.6 * std::sin(turn), 2e-3) << aop;
  }
  EXPECT_GT(recovered, 20);
}

TEST(Mosaic, OfOddSizeIsWholeUpToItsLastRowAndColumn) {
  const Sensor sensor = TwelveBits("90 45 / 135 0");
  Image<float> counts(9, 7, 1000);
  counts(8, 6) = counts(3, 6) = 4095;
  const LitMosaic mosaic = ToLitMosaic(counts, sensor);
  for (int y = 0; y < 7; ++y)
    for (int x = 0; x < 9; ++x)
      EXPECT_EQ(mosaic.state(x, y) == SampleState::kRecovered, y == 6 && (x == 8 || x == 3)) << x << " " << y;
}

// Noise of known size on even light: what a view says of itself against what it has.
TEST(Mosaic, StatesTheNoiseOfItsPolarizationForEveryMethod) {
  for (const double gain_known : {0.0, 1.0})
    for (const DemosaicMethod& method : DemosaicMethods()) {
      Sensor sensor = TwelveBits("90 45 / 135 0");
      const double sigma = 20 / sensor.RangeDn();
      if (gain_known) sensor.dn_per_e = 1e-9, sensor.read_noise_e = 20e9;
      Random random(11);
      Image<float> light = test::TakeMosaic(256, 256, sensor.layout, [](int, int, char) {
        return Stokes{0.9, 0.2, 0};
      });
      for (float& sample : light.pixels()) sample += float(sigma * random.Normal());
      const StokesImage view = ViewFromMosaic(ToCounts(light, sensor), sensor, method).stokes;
      double sum = 0, count = 0;
      for (int y = 24; y < 232; ++y)
        for (int x = 24; x < 232; ++x) sum += view.s2(x, y) * view.s2(x, y), ++count;
      EXPECT_NEAR(std::sqrt(2) * view.noise(128, 128) / std::sqrt(sum / count), 1, gain_known ? 0.04 : 0.15)
          << method.name;
    }
}

TEST(Angles, OneClippedPictureOfFourIsRecoveredAndTwoMakeTheirPixelInvalid) {
  std::array<Picture, 4> p;
  const float counts[] = {180, 150, 40, 70};
  for (std::size_t a = 0; a < 4; ++a) p[a] = {{Image<float>(6, 6, counts[a])}, 255, 8};
  Sensor sensor;
  sensor.white_dn = 160;  // the first one is clipped everywhere
  p[0].planes[0] = Image<float>(6, 6, 160);
  p[1].planes[0](3, 4) = 160;
  const StokesImage image = ViewFromAngles({&p[0], &p[1], &p[2], &p[3]}, sensor).stokes;
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 6; ++x) EXPECT_EQ(std::isinf(image.noise(x, y)), x == 3 && y == 4);
  EXPECT_NEAR(image.s1(1, 1), 140.0 / 160, 1e-5);
  EXPECT_NEAR(image.s0(1, 1), 220.0 / 160, 1e-5);
}

// Noise and values against what the samples were made with.
TEST(Angles, AnyThreeOrMoreGiveStokesAndTheirNoise) {
  Sensor sensor;
  sensor.bits = 16, sensor.white_dn = 65535, sensor.dn_per_e = 5;
  const double s0 = 0.8, s1 = 0.3, s2 = -0.1;
  const std::vector<std::vector<double>> sets = {
      {0, 60, 120}, {0, 20, 50, 130}, {10, 40, 100}, {0, 36, 72, 108, 144, 180}};
  for (const std::vector<double>& angles : sets) {
    Random random(7);
    std::vector<Picture> pictures;
    for (const double angle : angles) {
      const double twice = angle * M_PI / 90, light = (s0 + s1 * std::cos(twice) + s2 * std::sin(twice)) / 2;
      Picture picture{{Image<float>(200, 200)}, 65535, 16};
      for (float& count : picture.planes[0].pixels()) {
        const double electrons = light * 65535 / 5;
        count = float(std::round(5 * (electrons + std::sqrt(electrons) * random.Normal())));
      }
      pictures.push_back(std::move(picture));
    }
    const StokesImage image = ViewFromPolarizer(pictures, angles, sensor).stokes;
    const auto moments = [](const Image<float>& values) {
      double sum = 0, squares = 0;
      for (const float value : values.pixels()) sum += value, squares += double(value) * value;
      const double mean = sum / double(values.size());
      return std::pair(mean, squares / double(values.size()) - mean * mean);
    };
    const auto [mean0, variance0] = moments(image.s0);
    const auto [mean1, variance1] = moments(image.s1);
    const auto [mean2, variance2] = moments(image.s2);
    EXPECT_NEAR(mean0, s0, 1e-3);
    EXPECT_NEAR(mean1, s1, 1e-3);
    EXPECT_NEAR(mean2, s2, 1e-3);
    const double noise = image.noise(5, 5);  // its level is the mean one: 20 % where the samples' differ most
    EXPECT_NEAR(std::sqrt((variance1 + variance2) / 4) / noise, 1, 0.2);
    EXPECT_NEAR(std::sqrt(variance0) / (image.s0_noise * noise), 1, 0.2);
  }
  EXPECT_THROW(ViewFromPolarizer(std::vector<Picture>(3, Picture{{Image<float>(8, 8)}, 65535, 16}),
                                 {0, 90, 180}, sensor),
               Error);
}

TEST(Angles, AClippedSampleBehindThreePolarizersMakesItsPixelInvalid) {
  std::vector<Picture> pictures(3, Picture{{Image<float>(8, 8, 100)}, 255, 8});
  pictures[1].planes[0](3, 2) = 255;
  const StokesImage image = ViewFromPolarizer(pictures, {0, 60, 120}, Sensor()).stokes;
  EXPECT_TRUE(std::isinf(image.noise(3, 2)));
  EXPECT_TRUE(std::isfinite(image.noise(4, 2)));
}

}  // namespace
}  // namespace polarscan
