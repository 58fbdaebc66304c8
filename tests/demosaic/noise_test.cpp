// SPDX-License-Identifier: Apache-2.0
#include "demosaic/sensor/noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/random.h"
#include "demosaic/polar_view.h"
#include "mosaic.h"

namespace polarscan {
namespace {

// Smooth light between 0.05 and 0.95 with smooth polarization.
test::Stokes Hills(int x, int y, char) {
  const double level = 0.5 + 0.45 * std::sin(x * 0.02) * std::cos(y * 0.017);
  return {2 * level, 0.2 * level * std::cos(x * 0.011), 0.2 * level * std::sin(y * 0.013)};
}

// Standard deviation of shot noise (electrons) and read noise, in full scale.
double TrueSigma(double level, double full_well_e, double read_e) {
  return std::sqrt(level * full_well_e + read_e * read_e) / full_well_e;
}

std::array<Picture, 4> NoisyAngles(int size, double full_well_e, double read_e, bool common) {
  std::array<Picture, 4> pictures;
  for (std::size_t a = 0; a < 4; ++a) {
    pictures[a] = {{Image<float>(size, size)}, 1, 32};
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x)
        pictures[a].planes[0](x, y) = float(test::Behind(Hills(x, y, 'm'), kAnglesDeg[a]));
  }
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      Random random(7, std::uint64_t(x), std::uint64_t(y));
      const double sigma = TrueSigma(Hills(x, y, 'm').s0 / 2, full_well_e, read_e);
      // Common: noise of one Stokes image with sd(S0) = sigma, sd(S1) = sd(S2) = sqrt(2) sigma, shared by the
      // angles.
      const test::Stokes shared = {sigma * random.Normal(), std::sqrt(2) * sigma * random.Normal(),
                                   std::sqrt(2) * sigma * random.Normal()};
      for (std::size_t a = 0; a < 4; ++a)
        pictures[a].planes[0](x, y) +=
            float(common ? test::Behind(shared, kAnglesDeg[a]) : sigma * random.Normal());
    }
  return pictures;
}

PolarView View(const std::array<Picture, 4>& p, const Sensor& sensor) {
  return ViewFromAngles({&p[0], &p[1], &p[2], &p[3]}, sensor);
}

Sensor FloatSensor() {
  Sensor sensor;
  sensor.bits = 32, sensor.white_dn = 1, sensor.clips = false;
  return sensor;
}

// Estimated over true noise, the largest and the smallest ratio over the levels of the picture.
std::array<double, 2> Ratios(const PolarView& view, double gain, double full_well_e, double read_e) {
  double low = 1e9, high = 0;
  for (int y = 0; y < view.stokes.s0.height(); y += 7)
    for (int x = 0; x < view.stokes.s0.width(); x += 7) {
      const double truth = gain * TrueSigma(Hills(x, y, 'm').s0 / 2, full_well_e, read_e);
      low = std::min(low, view.stokes.noise(x, y) / truth),
      high = std::max(high, view.stokes.noise(x, y) / truth);
    }
  return {low, high};
}

TEST(Noise, IsFoundInAnglePicturesAtEveryBrightness) {
  const auto [low, high] = Ratios(View(NoisyAngles(512, 8000, 10, false), FloatSensor()), 1, 8000, 10);
  EXPECT_GT(low, 0.9);
  EXPECT_LT(high, 1.15);
}

TEST(Noise, IsNotWhatGainsOfTheAnglesThatDifferBring) {
  std::array<Picture, 4> pictures = NoisyAngles(400, 10000, 10, false);
  const double gains[4] = {1.03, 0.98, 1.0, 0.97};
  for (std::size_t a = 0; a < 4; ++a)
    for (float& value : pictures[a].planes[0].pixels()) value *= float(gains[a]);
  const auto [low, high] = Ratios(View(pictures, FloatSensor()), 1, 10000, 10);
  EXPECT_GT(low, 0.85);
  EXPECT_LT(high, 1.2);
}

TEST(Noise, ThatAllAnglesShareIsFoundThoughTheRedundancyIsZero) {
  const auto [low, high] = Ratios(View(NoisyAngles(512, 8000, 10, true), FloatSensor()), 1, 8000, 10);
  EXPECT_GT(low, 0.85);
  EXPECT_LT(high, 1.15);
}

TEST(Noise, OfTheBlackBackgroundDoesNotHideThatOfTheObject) {
  auto pictures = NoisyAngles(400, 8000, 10, true);
  for (Picture& picture : pictures)
    for (int y = 0; y < 400; ++y)
      for (int x = 0; x < 400; ++x)
        if (std::hypot(x - 200, y - 200) > 80) picture.planes[0](x, y) = 0;
  const PolarView view = View(pictures, FloatSensor());
  const double truth = TrueSigma(Hills(200, 200, 'm').s0 / 2, 8000, 10);
  EXPECT_NEAR(view.stokes.noise(200, 200) / truth, 1, 0.15);
}

TEST(Noise, OfAMosaicIsWhatDemosaicingLeavesOfIt) {
  const Layout layout = ParseLayout("90 45 / 135 0");
  Image<float> mosaic = test::TakeMosaic(600, 600, layout, Hills);
  for (int y = 0; y < 600; ++y)
    for (int x = 0; x < 600; ++x) {
      Random random(3, std::uint64_t(x), std::uint64_t(y));
      mosaic(x, y) += float(TrueSigma(mosaic(x, y), 8000, 10) * random.Normal());
    }
  const auto [low, high] =
      Ratios(ViewFromMosaic(mosaic, FloatSensor(), FindDemosaicMethod("bilinear")), 0.75, 8000, 10);
  EXPECT_GT(low, 0.85);
  EXPECT_LT(high, 1.2);
}

TEST(Noise, FollowsFromGainAndReadNoise) {
  Sensor sensor;  // 12 bits, 0.375 DN per electron
  sensor.bits = 12, sensor.black_dn = 60, sensor.white_dn = 4000, sensor.dn_per_e = 0.375,
  sensor.read_noise_e = 2.5;
  const NoiseModel model = SensorNoise(sensor);
  const double electrons = 0.4 * 3940 / 0.375;
  const double sigma_dn = std::sqrt(0.375 * 0.375 * (electrons + 2.5 * 2.5) + 1 / 12.0);
  EXPECT_NEAR(model.Sigma(0.4f), sigma_dn / 3940, 1e-7);
  EXPECT_GT(model.Sigma(-0.1f), 0);
}

TEST(Noise, IsNeverZeroAndAtLeastThatOfRounding) {
  Picture flat{{Image<float>(64, 64, 100)}, 255, 8};
  const PolarView view = ViewFromAngles({&flat, &flat, &flat, &flat}, Sensor{});
  EXPECT_NEAR(view.stokes.noise(30, 30), 1 / std::sqrt(12.0) / 255, 1e-6);
  Picture dark{{Image<float>(8, 8, 0.0f)}, 1, 32};
  EXPECT_GT(ViewFromAngles({&dark, &dark, &dark, &dark}, FloatSensor()).stokes.noise(4, 4), 0);
}

}  // namespace
}  // namespace polarscan
