// SPDX-License-Identifier: Apache-2.0
#include "demosaic/stokes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/image_io.h"

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
  WriteFloatTiff(path, {&image.s0, &image.s1});
  EXPECT_THROW(ReadStokes(path), Error);
  fs::remove(path);
}

}  // namespace
}  // namespace polarscan
