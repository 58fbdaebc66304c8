// SPDX-License-Identifier: Apache-2.0
#include "demosaic/fused/fused.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/random.h"
#include "demosaic/method.h"
#include "demosaic/stokes.h"
#include "mosaic.h"

namespace polarscan {
namespace {

constexpr const char* kMethods[] = {"bilinear", "difference", "linear"};

Sensor MakeSensor(const Layout& layout, int bits) {
  Sensor sensor;
  sensor.layout = layout, sensor.bits = bits;
  sensor.black_dn = 5, sensor.white_dn = (1 << bits) - 1;
  return sensor;
}

Image<std::uint16_t> RandomMosaic(int width, int height, int bits, std::uint64_t seed) {
  Image<std::uint16_t> mosaic(width, height);
  Random random(seed);
  for (std::uint16_t& sample : mosaic.pixels()) sample = std::uint16_t(random.Below(1u << bits));
  return mosaic;
}

// Against Unpack, ToLight and the method's own function: the tolerances that fused.h states.
void ExpectSameAsStepByStep(const std::string& method, const PixelFormat& format, const Layout& layout,
                            int width, int height) {
  const Sensor sensor = MakeSensor(layout, format.bits);
  const Image<std::uint16_t> mosaic = RandomMosaic(width, height, format.bits, std::uint64_t(width * height));
  Image<float> counts(width, height);
  std::ranges::copy(mosaic.pixels(), counts.pixels().begin());
  const AnglePlanes i = FindDemosaicMethod(method).interpolate(ToLight(counts, sensor), layout)[0];
  PolarPlanes planes;
  FusedDemosaic(method, sensor, format, width, height)(Pack(format, mosaic), planes, true);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float s0 = (i[0](x, y) + i[1](x, y) + i[2](x, y) + i[3](x, y)) / 2, s1 = i[0](x, y) - i[2](x, y),
                  s2 = i[1](x, y) - i[3](x, y);
      ASSERT_NEAR(planes.s0(x, y), s0, 4e-6) << method << format.name << ToString(layout) << x << " " << y;
      ASSERT_NEAR(planes.s1(x, y), s1, 4e-6) << method << format.name << ToString(layout) << x << " " << y;
      ASSERT_NEAR(planes.s2(x, y), s2, 4e-6) << method << format.name << ToString(layout) << x << " " << y;
      const float f0 = planes.s0(x, y), f1 = planes.s1(x, y), f2 = planes.s2(x, y);
      ASSERT_NEAR(planes.dop(x, y), DegreeOfPolarization(f0, f1, f2), 1e-6 * (1 + planes.dop(x, y)));
      const float away = std::abs(planes.aop(x, y) - AngleOfPolarization(f1, f2));
      ASSERT_LT(std::min(away, std::numbers::pi_v<float> - away), 2e-5f);
      ASSERT_GE(planes.aop(x, y), 0);
      ASSERT_LT(planes.aop(x, y), std::numbers::pi_v<float>);
    }
}

TEST(FusedDemosaic, GivesWhatItsStepsGiveForEveryLayout) {
  for (const char* method : kMethods)
    for (const Layout& layout : test::AllLayouts(""))
      ExpectSameAsStepByStep(method, ParsePixelFormat("Mono12p"), layout, 50, 37);
}

TEST(FusedDemosaic, GivesWhatItsStepsGiveForEveryFormat) {
  for (const char* format :
       {"Mono8", "Mono10", "Mono12", "Mono16", "Mono10p", "Mono12p", "Mono12Packed", "Mono10csi2p"})
    for (const int width : {64, 63, 41})
      ExpectSameAsStepByStep("bilinear", ParsePixelFormat(format), ParseLayout("90 45 / 135 0"), width, 35);
}

TEST(FusedDemosaic, GivesWhatItsStepsGiveForEverySize) {
  for (const char* method : kMethods)
    for (int width = 4; width < 40; width += 3)
      for (const int height : {4, 5, 31, 33, 66})
        ExpectSameAsStepByStep(method, ParsePixelFormat("Mono8"), ParseLayout("90 45 / 135 0"), width,
                               height);
}

TEST(FusedDemosaic, GivesWhatItsStepsGiveOnEveryInstructionSet) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    SCOPED_TRACE(hwy::TargetName(target));
    for (const char* method : kMethods)
      for (const char* format : {"Mono8", "Mono12p", "Mono12Packed"})
        ExpectSameAsStepByStep(method, ParsePixelFormat(format), ParseLayout("0 90 / 45 135"), 70, 20);
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST(FusedDemosaic, SkipsPaddingAfterEachRow) {
  const PixelFormat format = ParsePixelFormat("Mono8");
  const Sensor sensor = MakeSensor({}, 8);
  const Image<std::uint16_t> mosaic = RandomMosaic(20, 12, 8, 1);
  std::vector<std::uint8_t> padded(24 * 12, 0xEE);
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 20; ++x) padded[std::size_t(24 * y + x)] = std::uint8_t(mosaic(x, y));
  PolarPlanes with, without;
  FusedDemosaic demosaic("bilinear", sensor, format, 20, 12);
  demosaic(padded, with, true, 24);
  demosaic(Pack(format, mosaic), without, true);
  EXPECT_TRUE(std::ranges::equal(with.s1.pixels(), without.s1.pixels()));
  EXPECT_TRUE(std::ranges::equal(with.aop.pixels(), without.aop.pixels()));
}

TEST(FusedDemosaic, RefusesWhatItIsNotFor) {
  const PixelFormat format = ParsePixelFormat("Mono8");
  const Sensor mono = MakeSensor({}, 8), colour = MakeSensor(ParseLayout("90 45 / 135 0 rggb"), 8);
  EXPECT_THROW(FusedDemosaic("eari", mono, format, 8, 8), Error);
  EXPECT_THROW(FusedDemosaic("bilinear", colour, format, 8, 8), Error);
  EXPECT_THROW(FusedDemosaic("bilinear", mono, format, 3, 8), Error);
  PolarPlanes planes;
  FusedDemosaic demosaic("bilinear", mono, format, 8, 8);
  EXPECT_THROW(demosaic(std::vector<std::uint8_t>(63), planes, false), Error);
}

}  // namespace
}  // namespace polarscan
