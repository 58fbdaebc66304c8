// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/polarizer/polarizer.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "imperfect_sensor.h"

namespace polarscan {
namespace {

using test::EvenAngles;
using test::ExpectError;
using test::ImperfectSensor;
using test::TurnedPolarizer;

// As in docs/calibration.md: noise of 1 % of full scale in every calibration frame.
ImperfectSensor NoisySensor() {
  ImperfectSensor sensor(128, 96, 5);
  sensor.noise = 0.01;
  return sensor;
}

PolarizerCalibration Calibrate(const ImperfectSensor& sensor, const std::vector<double>& angles_deg,
                               const PolarizerKnowledge& known) {
  Progress silent;
  return CalibratePolarizer(TurnedPolarizer(sensor, angles_deg), sensor.sensor, {}, known, false, silent);
}

PolarizerKnowledge Known(const std::vector<double>& angles_deg) {
  return {.angles_deg = angles_deg, .frames = {}};
}

TEST(CalibratePolarizer, FindsEveryPixelsResponseExactlyWithoutNoise) {
  const ImperfectSensor sensor(64, 48, 1);
  const auto angles = EvenAngles(12);
  const PolarizerCalibration found = Calibrate(sensor, angles, Known(angles));
  EXPECT_EQ(found.defects, 0u);
  double worst_angle = 0, worst_diattenuation = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const Response a = found.responses.At(x, y), b = sensor.truth.At(x, y);
      const int layout = sensor.sensor.layout.AngleAt(x, y);
      // The mean over the pixels is the zero: it differs from the true one by the mean of their errors.
      worst_angle =
          std::max(worst_angle, std::abs(double(AngleErrorDeg(a, layout) - AngleErrorDeg(b, layout))));
      worst_diattenuation =
          std::max(worst_diattenuation, std::abs(double(a.Diattenuation() - b.Diattenuation())));
    }
  EXPECT_LT(worst_angle, 0.08);  // 1 degree / sqrt(3072) = 0.02, and 12 bits
  EXPECT_LT(worst_diattenuation, 0.002);
}

// The project's bar: at least 4 times less error of AoP than without calibration; unknown angles within 10 %
// of known ones.
TEST(CalibratePolarizer, MakesTheErrorOfAopFourTimesSmallerAndUnknownAnglesAreAsGood) {
  const ImperfectSensor sensor = NoisySensor();
  const double before = test::AopErrorDeg(sensor, {});
  for (const int frames : {12, 18, 36}) {
    const auto angles = EvenAngles(frames);
    const double known = test::AopErrorDeg(sensor, {{}, Calibrate(sensor, angles, Known(angles)).responses});
    const double unknown = test::AopErrorDeg(sensor, {{}, Calibrate(sensor, angles, {}).responses});
    std::printf(
        "%2d frames: AoP error %.3f deg uncalibrated, %.3f known angles (%.1f times less), "
        "%.3f unknown angles\n",
        frames, before, known, before / known, unknown);
    EXPECT_GT(before / known, frames == 36 ? 4 : 2.5) << frames;
    EXPECT_LT(unknown, 1.1 * known) << frames;
  }
}

TEST(CalibratePolarizer, FindsUnknownUnevenAngles) {
  const ImperfectSensor sensor = NoisySensor();
  const std::vector<double> angles = {3, 11, 40, 62, 71, 99, 120, 133, 160, 171, 20, 85};
  const PolarizerCalibration found = Calibrate(sensor, angles, {});
  for (std::size_t k = 0; k < angles.size(); ++k)
    EXPECT_NEAR(found.light.angles_deg[k], angles[k], 0.15) << k;
}

TEST(CalibratePolarizer, TakesTheSensorsZeroOfGivenAnglesUnlessToldThatTheyHaveIt) {
  const ImperfectSensor sensor = NoisySensor();
  const auto angles = EvenAngles(12);
  auto shifted = angles;
  for (double& angle : shifted) angle += 4;  // the mount's scale is turned by 4 degrees
  EXPECT_NEAR(Calibrate(sensor, angles, Known(shifted)).light.zero_deg, -4, 0.1);
  PolarizerKnowledge absolute = Known(shifted);
  absolute.zero_is_known = true;
  const PolarizerCalibration found = Calibrate(sensor, angles, absolute);
  EXPECT_EQ(found.light.zero_deg, 0);
  const nlohmann::json summary = Summary(found, sensor.sensor.layout);
  EXPECT_NEAR(summary["angle_error_deg"]["median"], 4, 0.1);
}

// A lamp that gets brighter: known angles do not mind, since brightness is found for each frame.
TEST(CalibratePolarizer, WithKnownAnglesTheLampMayDrift) {
  const ImperfectSensor sensor(64, 48, 2);
  const auto angles = EvenAngles(12);
  CalibrationFrames frames = TurnedPolarizer(sensor, angles);
  frames.counts = [&](int k) {
    return sensor.Take(test::BehindPolarizer(angles[std::size_t(k)], 0.8 - 0.02 * k));
  };
  Progress silent;
  const auto found = CalibratePolarizer(frames, sensor.sensor, {}, Known(angles), false, silent);
  EXPECT_LT(test::AopErrorDeg(sensor, {{}, found.responses}), 0.05);
  EXPECT_NEAR(found.light.stokes(0, 11) / found.light.stokes(0, 0), 0.58 / 0.8, 0.002);
}

// Vignetting belongs to light and lens; only what differs from pixel to pixel is the sensor's.
TEST(CalibratePolarizer, LeavesShadingOutOfTheGainsUnlessAsked) {
  ImperfectSensor sensor(256, 192, 3);
  ImperfectSensor shaded = sensor;
  const auto shade = [](int x, int y) { return 1 - 0.3 * (std::hypot(x - 128, y - 96) / 160); };
  for (int y = 0; y < 192; ++y)
    for (int x = 0; x < 256; ++x) {
      const Response r = sensor.truth.At(x, y);
      const float f = float(shade(x, y));
      shaded.truth.Set(x, y, {r.a0 * f, r.a1 * f, r.a2 * f});
    }
  const auto angles = EvenAngles(12);
  Progress silent;
  const auto corner_to_centre = [&](bool keep) {
    const auto found =
        CalibratePolarizer(TurnedPolarizer(shaded, angles), sensor.sensor, {}, Known(angles), keep, silent);
    double corner = 0, centre = 0;
    for (int y = 0; y < 16; ++y)
      for (int x = 0; x < 16; ++x)
        corner += found.responses.At(x, y).Gain(), centre += found.responses.At(120 + x, 88 + y).Gain();
    return corner / centre;
  };
  EXPECT_NEAR(corner_to_centre(true), (shade(8, 8) / shade(128, 91)), 0.01);
  EXPECT_GT(corner_to_centre(false), 0.95);
}

TEST(CalibratePolarizer, AColourSensorIsCalibratedTheSameWay) {
  ImperfectSensor sensor(96, 64, 6, "90 45 / 135 0 rggb");
  const auto angles = EvenAngles(18);
  const PolarizerCalibration found = Calibrate(sensor, angles, {});
  EXPECT_GT(test::AopErrorDeg(sensor, {}) / test::AopErrorDeg(sensor, {{}, found.responses}), 10);
}

TEST(CalibratePolarizer, APixelThatIsNothingLikeAPolarizerIsADefectAndIsRecovered) {
  ImperfectSensor sensor(64, 48, 4);
  sensor.truth.Set(21, 16, {0.02f, 0, 0});            // dead
  sensor.truth.Set(40, 30, MakeResponse(1, 0.1, 0));  // its polarizer is gone
  const auto angles = EvenAngles(12);
  const PolarizerCalibration found = Calibrate(sensor, angles, Known(angles));
  EXPECT_EQ(found.defects, 2u);
  EXPECT_TRUE(found.responses.At(21, 16).Defect());
  const LitMosaic lit =
      ToLitMosaic(sensor.Take(test::BehindPolarizer(30)), sensor.sensor, {{}, found.responses});
  EXPECT_EQ(lit.state(21, 16), SampleState::kRecovered);
  EXPECT_NEAR(lit.light(21, 16), test::Behind({0.8, 0.4, 0.8 * std::sqrt(0.75)}, 45), 0.005);
  EXPECT_EQ(lit.state(22, 16), SampleState::kMeasured);
}

TEST(CalibratePolarizer, SaysWhatIsWrongWithTheFrames) {
  const ImperfectSensor sensor = NoisySensor();
  const auto angles = EvenAngles(12);
  ExpectError([&] { Calibrate(sensor, EvenAngles(4), Known(EvenAngles(4))); }, "too few frames: 4");
  ExpectError([&] { Calibrate(sensor, EvenAngles(5), {}); }, "too few frames: 5 where at least 6");
  const std::vector<double> alike(12, 30.0);
  ExpectError([&] { Calibrate(sensor, alike, Known(alike)); }, "too much alike");
  ExpectError([&] { Calibrate(sensor, EvenAngles(12, 15), {}); }, "too much alike");
  auto wrong = angles;
  std::swap(wrong[3], wrong[7]);
  ExpectError([&] { Calibrate(sensor, angles, Known(wrong)); }, "does not fit what the frame shows");
  auto clockwise = angles;
  for (double& angle : clockwise) angle = -angle;
  ExpectError([&] { Calibrate(sensor, angles, Known(clockwise)); }, "the other way round");
  ImperfectSensor mistaken = sensor;
  mistaken.sensor.layout = ParseLayout("90 0 / 135 45");
  ExpectError([&] { Calibrate(mistaken, angles, {}); }, "calibrate layout");
}

TEST(CalibratePolarizer, NamesAFrameThatIsClippedOrDark) {
  const ImperfectSensor sensor(64, 48, 8);
  const auto angles = EvenAngles(12);
  for (const auto& [brightness, words] : std::vector<std::pair<double, std::string>>{
           {9, "every sample of this frame is clipped"}, {0.005, "dark"}}) {
    CalibrationFrames frames = TurnedPolarizer(sensor, angles);
    frames.counts = [&](int k) {
      // Unpolarized, so that all samples are alike.
      if (k == 5) return sensor.Take([&](int, int, char) { return test::Stokes{brightness, 0, 0}; });
      return sensor.Take(test::BehindPolarizer(angles[std::size_t(k)]));
    };
    Progress silent;
    ExpectError([&] { CalibratePolarizer(frames, sensor.sensor, {}, Known(angles), false, silent); }, words);
    ExpectError([&] { CalibratePolarizer(frames, sensor.sensor, {}, Known(angles), false, silent); }, "75");
  }
}

}  // namespace
}  // namespace polarscan
