// SPDX-License-Identifier: Apache-2.0
#include "demosaic/stokes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/formats/image_io.h"
#include "core/random.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

TEST(Stokes, AngleOfPolarizationIsThePolarizerThatPassesMost) {
  for (int degrees = 0; degrees < 180; degrees += 5) {
    const double turn = 2 * degrees * std::numbers::pi / 180;
    EXPECT_NEAR(AngleOfPolarization(float(std::cos(turn)), float(std::sin(turn))),
                degrees * std::numbers::pi / 180, 1e-6);
  }
}

TEST(Stokes, AngleOfPolarizationStaysBelowPi) {
  for (const float s2 : {-1e-30f, -1e-9f, -1e-7f, -0.0f, 0.0f})
    for (const float s1 : {1.0f, -1.0f, 0.0f}) {
      EXPECT_GE(AngleOfPolarization(s1, s2), 0);
      EXPECT_LT(AngleOfPolarization(s1, s2), std::numbers::pi);
    }
}

TEST(Stokes, DegreeOfPolarizationIsZeroWithoutLight) {
  EXPECT_EQ(DegreeOfPolarization(0, 1, 1), 0);
  EXPECT_EQ(DegreeOfPolarization(-1, 1, 1), 0);
  EXPECT_FLOAT_EQ(DegreeOfPolarization(2, 0.3f, 0.4f), 0.25f);
  EXPECT_FLOAT_EQ(DegreeOfPolarizationNoise(0.5f, 0.01f), 0.02f * std::sqrt(2.0f));
}

// Many measurements of the same light with noise: what the formulas must agree with.
struct Measurements {
  double mean_degree = 0, mean_debiased = 0, sd_angle_rad = 0;
};
Measurements Measure(double degree, double sigma) {
  Measurements m;
  Random random(3);
  const int count = 100000;
  for (int i = 0; i < count; ++i) {
    const double q = degree + sigma * random.Normal(), u = sigma * random.Normal();
    const double angle = std::atan2(u, q) / 2, p = std::hypot(q, u);
    m.mean_degree += p / count, m.sd_angle_rad += angle * angle / count;
    m.mean_debiased += DebiasedDegreeOfPolarization(float(p), float(sigma)) / count;
  }
  m.sd_angle_rad = std::sqrt(m.sd_angle_rad);
  return m;
}

TEST(Stokes, TheAnglesNoiseIsWhatManyMeasurementsShow) {
  for (const double ratio : {0.0, 0.3, 0.7, 1.0, 1.6, 2.0, 3.0, 5.0, 7.9, 8.1, 20.0})
    EXPECT_NEAR(
        AngleOfPolarizationNoise(float(0.03 * ratio), 0.03f) / Measure(0.03 * ratio, 0.03).sd_angle_rad, 1,
        0.015)
        << ratio;
  EXPECT_EQ(AngleOfPolarizationNoise(0.5f, 0), 0);
  EXPECT_NEAR(AngleOfPolarizationNoise(0, 0.1f), std::numbers::pi / std::sqrt(12), 1e-4);
  EXPECT_NEAR(AngleOfPolarizationNoise(0.1f, std::numeric_limits<float>::infinity()),
              std::numbers::pi / std::sqrt(12), 1e-4);
}

TEST(Stokes, ADebiasedDegreeIsRightInTheMeanToThreePercentAboveTwiceItsNoise) {
  for (const double ratio : {2.0, 3.0, 6.0}) {
    const Measurements m = Measure(0.02 * ratio, 0.02);
    EXPECT_NEAR(m.mean_debiased / 0.02, ratio, 0.03 * ratio) << ratio;
    EXPECT_GT(m.mean_degree, m.mean_debiased);
  }
  EXPECT_EQ(DebiasedDegreeOfPolarization(0, 0.1f), 0);
  EXPECT_EQ(DebiasedDegreeOfPolarization(0.3f, 0), 0.3f);
  for (const float tiny : {1e-3f, 1e-6f}) EXPECT_GE(DebiasedDegreeOfPolarization(tiny, 0.1f), 0);
}

TEST(Stokes, AFileKeepsEveryBit) {
  const fs::path path = fs::temp_directory_path() / "polarscan-stokes-test.tif";
  StokesImage image{Image<float>(7, 5), Image<float>(7, 5), Image<float>(7, 5), Image<float>(7, 5)};
  for (std::size_t i = 0; i < image.s0.size(); ++i) {
    image.s0.pixels()[i] = 0.1f * float(i);
    image.s1.pixels()[i] = -1e-20f * float(i);
    image.s2.pixels()[i] = std::sin(float(i));
    image.noise.pixels()[i] = i % 3 ? 0.01f : std::numeric_limits<float>::infinity();
  }
  WriteStokes(path, image);
  const StokesImage read = ReadStokes(path);
  const auto equal = [](const Image<float>& a, const Image<float>& b) {
    return SameSize(a, b) && std::ranges::equal(a.pixels(), b.pixels());
  };
  EXPECT_TRUE(equal(image.s0, read.s0) && equal(image.s1, read.s1) && equal(image.s2, read.s2) &&
              equal(image.noise, read.noise));
  EXPECT_EQ(read.s0_noise, 1);
  image.s0_noise = 7.0 / 3, image.independence = 0.1;
  WriteStokes(path, image);
  EXPECT_EQ(ReadStokes(path).s0_noise, 7.0 / 3);
  EXPECT_EQ(ReadStokes(path).independence, 0.1);
  WriteFloatTiff(path, {&image.s0, &image.s1, &image.s2, &image.noise}, R"({"s0_noise": -1})");
  EXPECT_THROW(ReadStokes(path), Error);
  WriteFloatTiff(path, {&image.s0, &image.s1, &image.s2, &image.noise}, "a lake");
  EXPECT_EQ(ReadStokes(path).independence, 1);
  WriteFloatTiff(path, {&image.s0, &image.s1});
  EXPECT_THROW(ReadStokes(path), Error);
  fs::remove(path);
}

TEST(PolarizationCorrection, TakesBiasAwayThenMirrorsThenTurns) {
  const double degrees = std::numbers::pi / 180;
  const auto image = [](double angle, double bias_s1, double bias_s2) {  // of S0 = 2, degree 0.3
    StokesImage one{Image<float>(1, 1, 2), Image<float>(1, 1), Image<float>(1, 1), Image<float>(1, 1, 0.01f)};
    one.s1(0, 0) = float(0.6 * std::cos(2 * angle) + 2 * bias_s1);
    one.s2(0, 0) = float(0.6 * std::sin(2 * angle) + 2 * bias_s2);
    return one;
  };
  StokesImage given = image(25 * degrees, 0.05, -0.02);
  Correct({-10, false, 0.05, -0.02}, given);
  EXPECT_NEAR(AngleOfPolarization(given.s1(0, 0), given.s2(0, 0)), 15 * degrees, 1e-5);
  EXPECT_NEAR(DegreeOfPolarization(2, given.s1(0, 0), given.s2(0, 0)), 0.3, 1e-6);
  given = image(25 * degrees, 0, 0);
  Correct({7, true, 0, 0}, given);
  EXPECT_NEAR(AngleOfPolarization(given.s1(0, 0), given.s2(0, 0)), (180 - 25 + 7) * degrees, 1e-5);
}

}  // namespace
}  // namespace polarscan
