// SPDX-License-Identifier: Apache-2.0
#include "stereo/costs/ncc.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "stereo/costs/problem.h"

namespace polarscan {
namespace {

float Texture(double x, double y) {
  return float(0.5 + 0.2 * std::sin(0.35 * x) + 0.2 * std::cos(0.27 * y + 0.1 * x));
}

Image<float> Render(int width, int height, double shift_x, double gain = 1) {
  Image<float> image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image(x, y) = float(gain) * Texture(x + shift_x, y);
  return image;
}

Patch ReadPatch(const Window& window, const Image<float>& gray, int x, int y) {
  Patch patch;
  PatchReader(window, 0.2).Read(gray, {}, x, y, patch);
  return patch;
}

// Pixel (x, y) of the reference falls on (x + shift, y) of the source.
Warp Shift(int x, int y, float shift) {
  return {float(x) + 0.5f + shift, 1, 0, float(y) + 0.5f, 0, 1, 1, 0, 0};
}

TEST(Ncc, IsZeroForTheRightWarpAndNotForAWrongOne) {
  const Window window = MakeWindow(5, 2);
  const PackedImage source = Pack(Render(80, 60, 3.25));
  const Patch patch = ReadPatch(window, Render(80, 60, {0}), 40, 30);
  EXPECT_LT(NccCostScalar(window, patch, Shift(40, 30, -3.25f), source, {0}), 2e-3f);
  EXPECT_GT(NccCostScalar(window, patch, Shift(40, 30, 4), source, {0}), 0.3f);
}

TEST(Ncc, DoesNotSeeTheSourcesGain) {
  const Window window = MakeWindow(5, 2);
  const Patch patch = ReadPatch(window, Render(80, 60, {0}), 40, 30);
  const float same = NccCostScalar(window, patch, Shift(40, 30, 1), Pack(Render(80, 60, {0})), {0});
  const float darker = NccCostScalar(window, patch, Shift(40, 30, 1), Pack(Render(80, 60, 0, 0.5)), {0});
  EXPECT_NEAR(same, darker, 1e-3f);
}

TEST(Ncc, EqualsItsDefinitionInDoublePrecision) {
  const Window window = MakeWindow(4, 1);
  const Image<float> reference = Render(80, 60, {0}), other = Render(80, 60, 7.5);
  const Patch patch = ReadPatch(window, reference, 40, 30);
  double sum = 0, r1 = 0, s1 = 0, rr = 0, ss = 0, rs = 0;
  for (int dy = -4; dy <= 4; ++dy)
    for (int dx = -4; dx <= 4; ++dx) {
      const double r = reference(40 + dx, 30 + dy), s = other(42 + dx, 30 + dy), c = r - reference(40, 30);
      const double w = std::exp(-(dx * dx + dy * dy) / 32.0 - c * c / 0.08);
      sum += w, r1 += w * r, s1 += w * s, rr += w * r * r, ss += w * s * s, rs += w * r * s;
    }
  r1 /= sum, s1 /= sum;
  const double ncc = (rs / sum - r1 * s1) / std::sqrt((rr / sum - r1 * r1) * (ss / sum - s1 * s1));
  EXPECT_NEAR(NccCostScalar(window, patch, Shift(40, 30, 2), Pack(other), {0}), 1 - ncc, 2e-3);
}

TEST(Ncc, MatchesFlatWithFlatByItsEpsilon) {
  const Window window = MakeWindow(5, 2);
  const Patch patch = ReadPatch(window, Image<float>(40, 40, 0.4f), 20, 20);
  EXPECT_LT(NccCostScalar(window, patch, Shift(20, 20, 1), Pack(Image<float>(40, 40, 0.7f)), {1e-5f}), 0.01f);
}

TEST(Ncc, WithoutEpsilonFlatPatchesCostTwoAndAreNoNumbers) {
  const Window window = MakeWindow(5, 2);
  const Image<float> flat(40, 40, 0.4f), textured = Render(40, 40, 0);
  for (const auto& cost : {NccCostScalar, NccCostSimd}) {
    EXPECT_EQ(cost(window, ReadPatch(window, flat, 20, 20), Shift(20, 20, 1), Pack(flat), {}), 2);
    EXPECT_EQ(cost(window, ReadPatch(window, textured, 20, 20), Shift(20, 20, 1), Pack(flat), {}), 2);
    EXPECT_EQ(cost(window, ReadPatch(window, flat, 20, 20), Shift(20, 20, 1), Pack(textured), {}), 2);
  }
}

TEST(Ncc, PatchesBelowTheLeastVarianceCostTwoAsInColmap) {
  const Window window = MakeWindow(5, 2);
  const Image<float> textured = Render(40, 40, 0);
  const Patch patch = ReadPatch(window, textured, 20, 20);
  const float least = 1.01f * patch.variance;  // that of the source under no shift is the same
  for (const auto& cost : {NccCostScalar, NccCostSimd}) {
    const auto match = [&](const Contrast& contrast) {
      return cost(window, patch, Shift(20, 20, 0), Pack(textured), contrast);
    };
    EXPECT_LT(match({}), 1e-3f);
    EXPECT_EQ(match({0, least, 0}), 2);
    EXPECT_EQ(match({0, 0, least}), 2);
    EXPECT_LT(match({0, 0.9f * patch.variance, 0.9f * patch.variance}), 1e-3f);
  }
}

TEST(Ncc, IsWorstBehindTheSourceAndOutsideOfItsPicture) {
  const Window window = MakeWindow(5, 2);
  const Image<float> gray = Render(80, 60, {0});
  const Patch patch = ReadPatch(window, gray, 40, 30);
  Warp behind = Shift(40, 30, {0});
  behind.w0 = 0.1f, behind.wx = 0.05f;
  EXPECT_EQ(NccCostScalar(window, patch, behind, Pack(gray), {1e-5f}), 2);
  EXPECT_EQ(NccCostSimd(window, patch, behind, Pack(gray), {1e-5f}), 2);
  EXPECT_EQ(NccCostScalar(window, patch, Shift(40, 30, 60), Pack(gray), {1e-5f}), 2);
  EXPECT_EQ(NccCostSimd(window, patch, Shift(40, 30, 60), Pack(gray), {1e-5f}), 2);
}

TEST(Ncc, VectorsAgreeWithTheScalarReferenceOnRandomWarps) {
  const Image<float> gray = Render(80, 60, {0});
  const PackedImage source = Pack(Render(80, 60, 1.7));
  for (const auto& [radius, step] : {std::pair{5, 2}, {4, 2}, {5, 1}, {10, 1}, {1, 1}}) {
    const Window window = MakeWindow(radius, step);
    for (std::uint64_t i = 0; i < 300; ++i) {
      Random random(7, i);
      const int x = int(random.Below(80)), y = int(random.Below(60));
      const Patch patch = ReadPatch(window, gray, x, y);
      const auto r = [&](float s) { return random.Uniform(-s, s); };
      const Warp warp{float(x) + r(20), 1 + r(.5f), r(.5f),  float(y) + r(20), r(.5f),
                      1 + r(.5f),       1 + r(.2f), r(.02f), r(.02f)};
      EXPECT_NEAR(NccCostScalar(window, patch, warp, source, {1e-5f}),
                  NccCostSimd(window, patch, warp, source, {1e-5f}), 1e-3f);
    }
  }
}

TEST(Window, WithoutItsCornersHasThirtyTwoSamples) {
  const Window window = MakeWindow(5, 2, false);
  EXPECT_EQ(window.taps, 32);
  EXPECT_EQ(window.padded, 32);
  for (int i = 0; i < window.taps; ++i) EXPECT_LT(std::hypot(window.dx[i], window.dy[i]), 6);
}

TEST(PlaneWarp, FollowsThePointsOfTheHypothesisPlane) {
  StereoView reference, other;
  reference.camera = {640, 480, 500, 510, 320, 240};
  other.camera = {800, 600, 700, 690, 410, 290};
  other.cam_from_world.rotation =
      Eigen::AngleAxisd(0.3, Eigen::Vector3d(0.2, 1, 0.1).normalized()).toRotationMatrix();
  other.cam_from_world.translation = {-1.1, 0.2, 0.3};
  const Source source = MakeSource(reference, std::make_shared<StereoView>(other), nullptr);
  const Hypothesis plane{4.0f, Eigen::Vector3f(0.3f, -0.2f, -1).normalized()};
  const Eigen::Vector3f ray = reference.camera.Ray(200.5, 300.5).cast<float>();
  const Warp warp = PlaneWarp(reference.camera, source, ray, source.rotation * ray, plane);
  for (const auto& [dx, dy] : {std::pair{0.f, 0.f}, {5.f, -5.f}, {-4.f, 3.f}}) {
    const Eigen::Vector3d there = reference.camera.Ray(200.5 + dx, 300.5 + dy);
    const double depth = plane.depth * double(plane.normal.dot(ray)) / plane.normal.cast<double>().dot(there);
    const Eigen::Vector2d expected = other.camera.Project(other.cam_from_world * (depth * there));
    const float w = warp.w0 + warp.wx * dx + warp.wy * dy;
    EXPECT_NEAR((warp.u0 + warp.ux * dx + warp.uy * dy) / w, expected.x(), 1e-3);
    EXPECT_NEAR((warp.v0 + warp.vx * dx + warp.vy * dy) / w, expected.y(), 1e-3);
  }
}

}  // namespace
}  // namespace polarscan
