// SPDX-License-Identifier: Apache-2.0
// Dark frames, flat frames and the layout.
#include <gtest/gtest.h>

#include "core/error.h"
#include "demosaic/calibration/dark.h"
#include "demosaic/calibration/flat.h"
#include "demosaic/calibration/polarizer/find_layout.h"
#include "imperfect_sensor.h"

namespace polarscan {
namespace {

using test::ExpectError;
using test::Stokes;

constexpr double kGain_dn = 0.375, kRead_e = 5;

// A sensor with true black levels, shot noise and read noise, in counts.
struct CountingSensor {
  Sensor sensor;
  Image<float> black_dn;
  Image<float> gains;

  CountingSensor(int width, int height, double black_spread, double gain_spread)
      : black_dn(width, height), gains(width, height) {
    sensor.layout = ParseLayout("90 45 / 135 0");
    sensor.bits = 12, sensor.black_dn = 60, sensor.white_dn = 4000;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        Random random(9, std::uint64_t(x), std::uint64_t(y));
        const int angle = sensor.layout.AngleAt(x, y);
        black_dn(x, y) = float(60 + angle / 45 + black_spread * random.Normal());
        gains(x, y) = float(1 + (angle == 90 ? 0.02 : 0) + gain_spread * random.Normal());
      }
  }
  // Mean light in electrons, unevenly lit: a fifth less at the right edge.
  Image<float> Take(double electrons, std::uint64_t shot, double s1 = 0) const {
    Image<float> counts(gains.width(), gains.height());
    for (int y = 0; y < counts.height(); ++y)
      for (int x = 0; x < counts.width(); ++x) {
        Random random(10, shot, std::uint64_t(x), std::uint64_t(y));
        const double lit = electrons * gains(x, y) * (1 - 0.2 * x / counts.width()) *
                           (1 + s1 * std::cos(2 * sensor.layout.AngleAt(x, y) * kRadPerDeg));
        const double noisy = lit + std::sqrt(lit + kRead_e * kRead_e) * random.Normal();
        counts(x, y) = float(std::clamp(std::round(black_dn(x, y) + kGain_dn * noisy), 0.0, 4000.0));
      }
    return counts;
  }
};

CalibrationFrames Frames(int count, const std::function<Image<float>(int)>& take) {
  CalibrationFrames frames;
  for (int k = 0; k < count; ++k) frames.names.push_back(std::to_string(k));
  frames.counts = take;
  return frames;
}

double RmsDifference(const Image<float>& a, const Image<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(a.pixels()[i] - b.pixels()[i], 2);
  return std::sqrt(sum / double(a.size()));
}

TEST(CalibrateDark, FindsBlackLevelsByPixelAndPolarizerAndTheReadNoise) {
  const CountingSensor camera(96, 64, 3, 0);
  Progress silent;
  const DarkCalibration dark = CalibrateDark(
      Frames(16, [&](int k) { return camera.Take(0, std::uint64_t(k)); }), camera.sensor, silent);
  EXPECT_NEAR(dark.read_noise_dn, kGain_dn * kRead_e, 0.02);
  EXPECT_NEAR(dark.pixel_spread_dn, 3, 0.1);
  EXPECT_NEAR(dark.angle_dn[3] - dark.angle_dn[0], 3, 0.3);
  // The mean of 16 frames has a quarter of the noise of one.
  EXPECT_LT(RmsDifference(dark.black_dn, camera.black_dn), 0.27 * kGain_dn * kRead_e);
}

// With black levels all alike, the mean of few frames would only bring noise in.
TEST(CalibrateDark, FewFramesDoNotMakePicturesNoisier) {
  const CountingSensor camera(96, 64, 0, 0);
  Progress silent;
  const DarkCalibration dark = CalibrateDark(
      Frames(4, [&](int k) { return camera.Take(0, std::uint64_t(k)); }), camera.sensor, silent);
  EXPECT_LT(RmsDifference(dark.black_dn, camera.black_dn), 0.1 * kGain_dn * kRead_e);
}

TEST(CalibrateDark, RefusesLightAndTooFewFrames) {
  const CountingSensor camera(16, 16, 0, 0);
  Progress silent;
  ExpectError(
      [&] { CalibrateDark(Frames(3, [&](int) { return camera.Take(0, 1); }), camera.sensor, silent); },
      "too few frames: 3");
  ExpectError(
      [&] { CalibrateDark(Frames(8, [&](int) { return camera.Take(8000, 1); }), camera.sensor, silent); },
      "not dark");
}

// Pictures of something instead of dark frames: dim all over, or with something dim in them.
TEST(CalibrateDark, RefusesDimPictures) {
  CountingSensor camera(64, 64, 0, 0);
  Progress silent;
  const auto calibrate = [&](double left_e, double right_e) {
    CalibrateDark(Frames(8,
                         [&](int k) {
                           Image<float> counts = camera.Take(left_e, std::uint64_t(k));
                           const Image<float> right = camera.Take(right_e, std::uint64_t(k));
                           for (int y = 0; y < 64; ++y)
                             std::copy_n(right.row(y) + 32, 32, counts.row(y) + 32);
                           return counts;
                         }),
                  camera.sensor, silent);
  };
  calibrate(0, 0);
  ExpectError([&] { calibrate(2000, 2000); }, "far above the black level of 60 DN");
  ExpectError([&] { calibrate(0, 400); }, "its parts differ by");
  camera.sensor.black_dn = 0;  // not said
  ExpectError([&] { calibrate(0, 400); }, "its parts differ by");
}

TEST(CalibrateFlat, FindsGainAndReadNoiseFromPairsOfFrames) {
  const CountingSensor camera(128, 96, 3, 0.02);
  Progress silent;
  const auto take = [&](int k) {
    return camera.Take(k < 2 ? 50 : 1000 * std::pow(2, (k - 2) / 2), std::uint64_t(k));
  };
  const FlatCalibration flat =
      CalibrateFlat(Frames(10, take), camera.sensor, camera.black_dn, -1, {}, silent);
  EXPECT_EQ(flat.pairs, 5);
  EXPECT_NEAR(flat.all.dn_per_e / kGain_dn, 1, 0.02);
  EXPECT_NEAR(flat.all.read_noise_dn, kGain_dn * kRead_e, 0.25 * kGain_dn * kRead_e);
  for (const PhotonTransfer& angle : flat.by_angle) EXPECT_NEAR(angle.dn_per_e / kGain_dn, 1, 0.04);
  const FlatCalibration known =
      CalibrateFlat(Frames(10, take), camera.sensor, camera.black_dn, kGain_dn * kRead_e, {}, silent);
  EXPECT_NEAR(known.all.dn_per_e / kGain_dn, 1, 0.02);
}

TEST(CalibrateFlat, FindsThePixelsGainsAndThoseOfPolarizersOnlyInUnpolarizedLight) {
  const CountingSensor camera(128, 96, 0, 0.02);
  Progress silent;
  const auto take = [&](int k) { return camera.Take(8000, std::uint64_t(k)); };
  const auto error = [&](const FlatCalibration& flat) {  // spread of found over true gain
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < camera.gains.size(); ++i) {
      const double ratio = 2 * flat.responses.a0.pixels()[i] / camera.gains.pixels()[i];
      sum += ratio, squares += ratio * ratio;
    }
    const double n = double(camera.gains.size());
    return std::sqrt(squares / n - sum * sum / n / n) / (sum / n);
  };
  const FlatCalibration any = CalibrateFlat(Frames(20, take), camera.sensor, camera.black_dn, 1, {}, silent);
  const FlatCalibration unpolarized =
      CalibrateFlat(Frames(20, take), camera.sensor, camera.black_dn, 1, {.unpolarized = true}, silent);
  EXPECT_NEAR(any.gain_spread, 0.02, 0.002);
  EXPECT_NEAR(unpolarized.gain_by_angle[2] / unpolarized.gain_by_angle[0], 1.02, 0.004);  // one place to the
  // next, the light is 0.2 % less
  EXPECT_LT(error(unpolarized), 0.005);
  EXPECT_GT(error(any), 0.006);  // the 2 % of one polarizer are left
  // Polarized light of 10 % does not become a gain of the polarizers, unless it is said to be none.
  const auto polarized = [&](int k) { return camera.Take(7000, std::uint64_t(k), 0.1); };
  EXPECT_LT(error(CalibrateFlat(Frames(20, polarized), camera.sensor, camera.black_dn, 1, {}, silent)),
            0.012);
}

TEST(CalibrateFlat, SaysWhatIsWrongWithTheFrames) {
  const CountingSensor camera(32, 32, 0, 0);
  Progress silent;
  const auto calibrate = [&](int count, const std::function<double(int)>& electrons) {
    CalibrateFlat(Frames(count, [&](int k) { return camera.Take(electrons(k), std::uint64_t(k)); }),
                  camera.sensor, {}, -1, {}, silent);
  };
  ExpectError([&] { calibrate(1, [](int) { return 5000.0; }); }, "too few frames: 1");
  ExpectError([&] { calibrate(4, [](int k) { return 1000.0 * (k + 1); }); }, "no two frames");
  ExpectError([&] { calibrate(4, [](int) { return 60000.0; }); }, "every sample of this frame is clipped");
}

CellMeans MeansOf(const Layout& layout, double angle_deg, double brightness) {
  CellMeans cell;
  for (std::size_t i = 0; i < 4; ++i)
    cell[i] = brightness * (1 + 0.97 * std::cos(2 * (angle_deg - layout.angles_deg[i]) * kRadPerDeg)) *
              (i == 2 ? 1.02 : 1);
  return cell;
}

TEST(FindLayout, FindsEveryLayoutFromAPolarizerTurnedEitherWay) {
  for (const Layout& layout : test::AllLayouts("")) {
    // 0 and 90 must be on a pair of places; all 24 orders are possible layouts to tell apart.
    for (const bool anticlockwise : {true, false})
      for (const double first : {0.0, 6.0, 100.0}) {
        std::vector<CellMeans> frames;
        for (int k = 0; k < 9; ++k)
          frames.push_back(
              MeansOf(layout, first + (anticlockwise ? 1 : -1) * (20 * k + k % 2), 1 - 0.01 * k));
        const FoundLayout found = FindLayout(frames, first == 6 ? 0 : first, anticlockwise);
        EXPECT_EQ(found.layout, layout) << ToString(found.layout) << " for " << ToString(layout);
        EXPECT_NEAR(found.first_error_deg, first == 6 ? 6 : 0, 1.0);
      }
  }
}

TEST(FindLayout, SaysWhatIsNotClear) {
  const Layout layout = ParseLayout("90 45 / 135 0");
  const auto turned = [&](const std::vector<double>& angles) {
    std::vector<CellMeans> frames;
    for (const double angle : angles) frames.push_back(MeansOf(layout, angle, 1));
    FindLayout(frames, 0, true);
  };
  ExpectError([&] { turned({0, 20, 40}); }, "too few frames");
  ExpectError([&] { turned({0, 20, 40, 20, 60, 90}); }, "to and fro");
  ExpectError([&] { turned({0, 20, 40, 135, 150, 170}); }, "more than 80 degrees");
  ExpectError([&] { turned({22, 40, 60, 80, 100, 120}); }, "zero is not clear");
  ExpectError([&] { turned({0, 5, 10, 15, 20, 25}); }, "turned");
}

}  // namespace
}  // namespace polarscan
