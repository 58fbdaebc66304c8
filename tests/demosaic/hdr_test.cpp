// SPDX-License-Identifier: Apache-2.0
#include "demosaic/hdr.h"

#include <gtest/gtest.h>

#include "demosaic/polar_view.h"
#include "demosaic/sensor/noise.h"
#include "imperfect_sensor.h"

namespace polarscan {
namespace {

using test::Stokes;

Sensor TenThousandElectrons() {
  Sensor sensor;
  sensor.layout = ParseLayout("90 45 / 135 0");
  sensor.bits = 12, sensor.black_dn = 60, sensor.white_dn = 4000, sensor.dn_per_e = 0.394,
  sensor.read_noise_e = 3;
  return sensor;
}

// Light from 1/200 of full scale of the shortest exposure (left) to full scale (right), half polarized.
Stokes Ramp(int x, int, char) {
  const double s0 = 2 * 0.6 * std::pow(200, x / 127.0 - 1);
  return {s0, 0.3 * s0, -0.4 * s0};
}

// What an exposure `time` times the shortest one counts.
Exposure Take(const Sensor& sensor, double time, std::uint64_t shot, double said = 0) {
  Exposure exposure{Image<float>(128, 64), said > 0 ? said : time};
  const Image<float> light = test::TakeMosaic(128, 64, sensor.layout, Ramp);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 128; ++x) {
      Random random(6, shot, std::uint64_t(x), std::uint64_t(y));
      const double electrons = light(x, y) * time * sensor.RangeDn() / sensor.dn_per_e;
      const double noisy = electrons + std::sqrt(electrons + 9) * random.Normal();
      exposure.counts(x, y) = float(std::clamp(std::round(60 + noisy * sensor.dn_per_e), 0.0, 4000.0));
    }
  return exposure;
}

// Root mean square error of AoP in degrees over columns.
double AopError(const StokesImage& image, int x0, int x1) {
  double sum = 0, count = 0;
  const double truth = AngleOfPolarization(0.3f, -0.4f);
  for (int y = 2; y < 62; ++y)
    for (int x = x0; x < x1; ++x) {
      const double error =
          std::remainder(AngleOfPolarization(image.s1(x, y), image.s2(x, y)) - truth, std::numbers::pi);
      sum += error * error, ++count;
    }
  return std::sqrt(sum / count) * 180 / std::numbers::pi;
}

StokesImage View(const std::vector<Exposure>& exposures, const Sensor& sensor) {
  return ViewFromLight(MergeExposures(exposures, sensor), sensor, FindDemosaicMethod("bilinear")).stokes;
}

TEST(MergeExposures, IsAsGoodAsTheLongExposureInTheDarkAndAsTheShortOneInTheLight) {
  const Sensor sensor = TenThousandElectrons();
  const Exposure shortest = Take(sensor, 1, 1), longest = Take(sensor, 64, 2);
  const StokesImage merged = View({shortest, Take(sensor, 8, 3), longest}, sensor),
                    one = View({shortest}, sensor);
  EXPECT_LT(AopError(merged, 2, 30), 0.2 * AopError(one, 2, 30));
  EXPECT_LT(AopError(merged, 100, 126), 1.05 * AopError(one, 100, 126));
  for (int x = 2; x < 126; ++x) {
    ASSERT_TRUE(std::isfinite(merged.noise(x, 30)));
    EXPECT_NEAR(merged.s0(x, 30) / Ramp(x, 30, 'm').s0, 1, 0.08) << x;
  }
}

TEST(MergeExposures, TellsTheNoiseThatIsLeft) {
  const Sensor sensor = TenThousandElectrons();
  double sum = 0, count = 0;
  for (std::uint64_t shot = 0; shot < 12; ++shot) {
    const LitMosaic merged = MergeExposures(
        {Take(sensor, 1, 100 + shot), Take(sensor, 8, 200 + shot), Take(sensor, 64, 300 + shot)}, sensor);
    const Image<float> truth = test::TakeMosaic(128, 64, sensor.layout, Ramp);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const double z = (merged.light.pixels()[i] - truth.pixels()[i]) / merged.noise.pixels()[i];
      sum += z * z, ++count;
    }
  }
  EXPECT_NEAR(std::sqrt(sum / count), 1, 0.1);
}

// Time said 5 % too long for one exposure: the brightness of a cell changes, what is polarized does not.
TEST(MergeExposures, AWrongExposureTimeMakesNoFalsePolarization) {
  const Sensor sensor = TenThousandElectrons();
  const StokesImage right = View({Take(sensor, 1, 1), Take(sensor, 8, 3)}, sensor),
                    wrong = View({Take(sensor, 1, 1), Take(sensor, 8, 3, 8.4)}, sensor);
  EXPECT_NEAR(AopError(wrong, 2, 126) / AopError(right, 2, 126), 1, 0.02);
}

TEST(MergeExposures, WhereEvenTheShortestIsClippedTheCellIsRecoveredOrLost) {
  const Sensor sensor = TenThousandElectrons();
  Exposure shortest{Image<float>(8, 8, 2000), 1}, longest{Image<float>(8, 8, 4000), 4};
  shortest.counts(2, 2) = 4000;                          // one of a cell
  shortest.counts(4, 4) = shortest.counts(5, 4) = 4000;  // two
  const LitMosaic merged = MergeExposures({longest, shortest}, sensor);
  EXPECT_EQ(merged.state(2, 2), SampleState::kRecovered);
  EXPECT_EQ(merged.state(4, 4), SampleState::kLost);
  EXPECT_EQ(merged.state(0, 0), SampleState::kMeasured);
  EXPECT_NEAR(merged.light(0, 0), 1940.0 / 3940, 1e-5);
}

TEST(MergeExposures, WithoutKnownGainWeighsByTime) {
  Sensor sensor = TenThousandElectrons();
  sensor.dn_per_e = 0;
  const LitMosaic merged = MergeExposures({{Image<float>(4, 4, 160), 1}, {Image<float>(4, 4, 460), 3}},
                                          sensor);  // 100 and 400 / 3
  EXPECT_TRUE(merged.noise.empty());
  EXPECT_NEAR(merged.light(1, 1) * sensor.RangeDn(), (100 + 400) / 4.0, 1e-3);
}

}  // namespace
}  // namespace polarscan
