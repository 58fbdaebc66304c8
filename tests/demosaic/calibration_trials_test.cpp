// SPDX-License-Identifier: Apache-2.0
#include "calibration_trials.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "demosaic/calibration/polarizer/sample_noise.h"

namespace polarscan {
namespace {

using test::Mishap;
using test::Trial;

constexpr std::uint64_t kSeeds = 20;
const std::map<Mishap, std::string> kMishapNames = {{Mishap::kNone, "no bad frame"},
                                                    {Mishap::kBumped, "bumped"},
                                                    {Mishap::kDimmed, "dimmed"},
                                                    {Mishap::kReflection, "reflection"},
                                                    {Mishap::kMislabelled, "mislabelled"}};

// Over all seeds: root mean squares of the errors, shares of pixels within one standard deviation, and how
// often frames were doubted.
struct TrialsResult {
  double angle_deg = 0, diattenuation = 0;
  double angles_within = 0, diattenuations_within = 0;
  int found = 0, mistaken = 0;
};

// Shares of the pixels that lie within one deviation of the truth.
void CountWithin(const PolarizerCalibration& found, const test::ImperfectSensor& sensor,
                 TrialsResult& result) {
  const ResponseMap& map = found.responses;
  double common_deg = 0;  // the zero is where the polarizers are right in the mean
  const auto angle_off = [&](int x, int y) {
    const int layout = sensor.sensor.layout.AngleAt(x, y);
    return double(AngleErrorDeg(map.At(x, y), layout)) - double(AngleErrorDeg(sensor.truth.At(x, y), layout));
  };
  const double share = 1 / double(map.a0.size());
  for (int y = 0; y < map.height(); ++y)
    for (int x = 0; x < map.width(); ++x) common_deg += share * angle_off(x, y);
  for (int y = 0; y < map.height(); ++y)
    for (int x = 0; x < map.width(); ++x) {
      const auto i = std::size_t(sensor.sensor.layout.AngleAt(x, y) / 45);
      const ResponseDeviation &noise = found.light.by_noise[i], &light = found.light.by_light[i];
      const double off = map.At(x, y).Diattenuation() - sensor.truth.At(x, y).Diattenuation();
      const bool angle =
          std::abs(angle_off(x, y) - common_deg) < std::hypot(noise.angle_deg, light.angle_deg);
      const bool size = std::abs(off) < std::hypot(noise.diattenuation, light.diattenuation);
      result.angles_within += angle * share / kSeeds, result.diattenuations_within += size * share / kSeeds;
    }
}

TrialsResult RunTrials(const Trial& trial) {
  TrialsResult result;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const test::ImperfectSensor sensor = TrialSensor(trial, seed);
    Progress silent;
    const PolarizerCalibration found = Calibrated(trial, sensor, seed, silent);
    const test::TrialErrors errors = ErrorsOf(found.responses, sensor);
    result.angle_deg = std::hypot(result.angle_deg, errors.angle_deg / std::sqrt(kSeeds));
    result.diattenuation = std::hypot(result.diattenuation, errors.diattenuation / std::sqrt(kSeeds));
    CountWithin(found, sensor, result);
    for (const FrameDoubt& doubt : found.light.doubts)
      ++(doubt.frame == trial.BadFrame(seed) && trial.mishap != Mishap::kNone ? result.found
                                                                              : result.mistaken);
  }
  std::printf(
      "%d frames, %s angles, %-12s: angle off by %.3f deg (%.0f %% within a deviation), diattenuation %.4f "
      "(%.0f %%); bad frame found %d times, others %d times\n",
      trial.frames, trial.known ? "known" : "unknown", kMishapNames.at(trial.mishap).c_str(),
      result.angle_deg, 100 * result.angles_within, result.diattenuation, 100 * result.diattenuations_within,
      result.found, result.mistaken);
  return result;
}

// Deviations are right if 68 % of the pixels lie within one.
void ExpectRightDeviations(const TrialsResult& result) {
  EXPECT_GT(result.angles_within, 0.6);
  EXPECT_LT(result.angles_within, 0.76);
  EXPECT_GT(result.diattenuations_within, 0.6);
  EXPECT_LT(result.diattenuations_within, 0.76);
}

class OneBadFrame : public testing::TestWithParam<bool> {};

TEST_P(OneBadFrame, IsNamedAndTheCalibrationIsAlmostAsGoodAsWithoutIt) {
  for (const int frames : {12, 18}) {
    Trial trial{.frames = frames, .known = GetParam()};
    const TrialsResult good = RunTrials(trial);
    ExpectRightDeviations(good);
    EXPECT_LE(good.mistaken, 1);
    // Noise alone, all readings counting the same, leaves 0.0045 of 12 frames and 0.0038 of 18.
    EXPECT_LT(good.diattenuation, frames == 12 ? 0.0027 : 0.0022);
    for (const auto& [mishap, name] : kMishapNames) {
      if (mishap == Mishap::kNone || (mishap == Mishap::kMislabelled && !trial.known)) continue;
      trial.mishap = mishap;
      const TrialsResult bad = RunTrials(trial);
      ExpectRightDeviations(bad);
      EXPECT_LT(bad.angle_deg, 1.1 * good.angle_deg) << name;
      EXPECT_LT(bad.diattenuation, 1.2 * good.diattenuation) << name;
      EXPECT_LE(bad.mistaken, 1) << name;
      // With known angles the lamp may do what it likes.
      EXPECT_EQ(bad.found, mishap == Mishap::kDimmed && trial.known ? 0 : int(kSeeds)) << name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Angles, OneBadFrame, testing::Bool(), [](const auto& angles) {
  return std::string(angles.param ? "OfKnownAngles" : "OfUnknownAngles");
});

// Pixels as bright as each other, so that the dark readings of one frame are the bright ones of another.
TEST(SampleNoise, ReadNoiseAndShotNoiseAreFoundAsTheyWerePutIn) {
  constexpr double kConstant = 4e-6, kPerLight = 1e-4;
  constexpr int kPixels = 20000, kFrames = 12;
  PolarizerReadings readings{Eigen::MatrixXf(kPixels, kFrames), {}};
  Eigen::Matrix3Xd stokes(3, kFrames);
  for (int k = 0; k < kFrames; ++k) {
    const double turn = 2 * 15 * k * kRadPerDeg;
    stokes.col(k) << 1, std::cos(turn), std::sin(turn);
  }
  for (int i = 0; i < kPixels; ++i) {
    readings.angles_deg.push_back(45 * (i % 4));
    const Response r = MakeResponse(0.8, 0.97, 45 * (i % 4) * kRadPerDeg);
    for (int k = 0; k < kFrames; ++k) {
      const double light = r.a0 * stokes(0, k) + r.a1 * stokes(1, k) + r.a2 * stokes(2, k);
      Random random(3, std::uint64_t(i), std::uint64_t(k));
      readings.light(i, k) = float(light + std::sqrt(kConstant + kPerLight * light) * random.Normal());
    }
  }
  const WeighedFit fit = WeighByNoise(readings, stokes);
  EXPECT_NEAR(fit.noise.constant, kConstant, 0.05 * kConstant);
  EXPECT_NEAR(fit.noise.per_light, kPerLight, 0.02 * kPerLight);
  EXPECT_NEAR(fit.weights(0, 6) / fit.weights(0, 0),  // 90 and 0 degrees, seen by pixels at 0
              (kConstant + kPerLight * 0.4 * 1.97) / (kConstant + kPerLight * 0.4 * 0.03), 1);
}

}  // namespace
}  // namespace polarscan
