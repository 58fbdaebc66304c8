// SPDX-License-Identifier: Apache-2.0
#include "stereo/rounds/surface_matching.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "core/random.h"
#include "sphere_problem.h"
#include "stereo/rounds/band_rows.h"

namespace polarscan {
namespace {

// Waves of brightness, 5 to 7 pixels long, fixed on the sphere of a view.
Image<float> Textured(const SphereView& sphere) {
  Image<float> gray(kSize, kSize, 0.1f);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const float depth = sphere.map->depth(x, y);
      if (depth <= 0) continue;
      const Eigen::Vector3d point =
          sphere.view->cam_from_world.Inverse() * (double(depth) * kCamera.Ray(x + 0.5, y + 0.5));
      gray(x, y) = float(0.5 + 0.15 * std::sin(20 * point.x() + 3) + 0.15 * std::sin(26 * point.y()) +
                         0.1 * std::sin(23 * (point.z() + point.x())));
    }
  return gray;
}

// A textured sphere in five views.
SphereProblem TexturedSphere() {
  SphereProblem sphere({});
  sphere.own.view->gray = Textured(sphere.own);
  for (double angle : {-0.3, -0.15, 0.15, 0.3}) {
    const SphereView other = MakeSphereView(angle);
    other.view->gray = Textured(other);
    other.view->packed = Pack(other.view->gray);
    sphere.problem.sources.push_back(MakeSource(*sphere.own.view, other.view, other.map));
  }
  return sphere;
}

// Mean error of a depth map as a share of the depth where the sphere is not too steep.
double MeanError(const SphereView& sphere, const Image<float>& depth) {
  double sum = 0;
  int count = 0;
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      if (sphere.map->depth(x, y) <= 0 || sphere.map->normal(x, y).z() > -0.6f) continue;
      sum += std::abs(depth(x, y) / sphere.map->depth(x, y) - 1);
      ++count;
    }
  return sum / count;
}

TEST(BandRows, DrawSumAndCompareLikeTheirDefinitions) {
  constexpr int kColumns = 37, kTop = 3, kBottom = 21, kBegin = 6, kEnd = 19;
  const std::vector<float> taps = {0.4f, 0.2f, 0.1f};
  const Image<float> picture = [] {
    Image<float> image(50, 40);
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 50; ++x) image(x, y) = 0.5f + 0.4f * std::sin(0.3f * float(x) + 0.2f * float(y));
    return image;
  }();
  BandPlane x(kTop, kBottom, kColumns), y = x, z = x, seen = x, drawn = x, scratch = x, sums = x;
  Random random(5);
  for (int row = kTop; row < kBottom; ++row)
    for (int i = 0; i < kColumns; ++i) {
      z.Row(row)[i] = 2 + 0.01f * float(i), seen.Row(row)[i] = random.Uniform(0, 1) < 0.8 ? 1.0f : 0.0f;
      x.Row(row)[i] = z.Row(row)[i] * (float(i) - 18) / 50,
      y.Row(row)[i] = z.Row(row)[i] * float(row - 11) / 50;
    }
  const RowCamera camera{45, 45, 25, 20, 0.02f, -0.03f, 0.1f};
  for (int row = kTop; row < kBottom; ++row)
    DrawRow(picture, camera, 1.02f, x.Row(row), y.Row(row), z.Row(row), seen.Row(row), kColumns,
            drawn.Row(row));
  WindowSums(drawn, z, taps, kBegin, kEnd, scratch, sums);
  for (int row = kBegin; row < kEnd; ++row)
    for (int i = 0; i < kColumns; ++i) {
      double expected = 0;
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx)
          if (i + dx >= 0 && i + dx < kColumns && row + dy >= kTop && row + dy < kBottom)
            expected += double(taps[std::size_t(std::abs(dx))]) * taps[std::size_t(std::abs(dy))] *
                        drawn.Row(row + dy)[i + dx] * z.Row(row + dy)[i + dx];
      EXPECT_NEAR(sums.Row(row)[i], expected, 1e-5) << i << " " << row;
      const double pz = 1.02 * z.Row(row)[i] + 0.1, u = 45 * (1.02 * x.Row(row)[i] + 0.02) / pz + 25 - 0.5,
                   v = 45 * (1.02 * y.Row(row)[i] - 0.03) / pz + 20 - 0.5;
      const int left = int(u), top = int(v);
      const double au = u - left, av = v - top;
      const double value = (picture(left, top) * (1 - au) + picture(left + 1, top) * au) * (1 - av) +
                           (picture(left, top + 1) * (1 - au) + picture(left + 1, top + 1) * au) * av;
      EXPECT_NEAR(drawn.Row(row)[i], seen.Row(row)[i] > 0 ? value - 0.5 : 0, 1e-4) << i << " " << row;
    }
  std::vector<float> w(kColumns, 2), r(kColumns), rr(kColumns), s(kColumns), ss(kColumns), rs(kColumns),
      cost(kColumns + 16);
  for (std::vector<float>* sum : {&w, &r, &rr, &s, &ss, &rs}) sum->resize(kColumns + 16, 1);
  for (int i = 0; i < kColumns; ++i) {
    const std::size_t k = std::size_t(i);
    r[k] = float(random.Uniform(-1, 1)), s[k] = float(random.Uniform(-1, 1));
    rr[k] = r[k] * r[k] / 2 + 1, ss[k] = s[k] * s[k] / 2 + 3,
    rs[k] = r[k] * s[k] / 2 + float(random.Uniform(-1, 1));
  }
  MatchingCostRow({w.data(), r.data(), rr.data(), s.data(), ss.data(), rs.data()}, 1e-5f, kColumns,
                  cost.data());
  for (int i = 0; i < kColumns; ++i) {
    const std::size_t k = std::size_t(i);
    const double expected =
        1 - (rs[k] - r[k] * s[k] / 2) / std::sqrt((rr[k] - r[k] * r[k] / 2) * (ss[k] - s[k] * s[k] / 2));
    EXPECT_NEAR(cost[k], expected, 1e-4);
  }
}

// 0.001 of the depth are 0.05 px in the farthest source.
TEST(SurfaceMatching, MovesACurvedSurfaceToWhereThePicturesAgree) {
  const SphereProblem sphere = TexturedSphere();
  for (float off : {1.006f, 0.994f}) {
    DepthNormalMap start = *sphere.own.map;
    for (float& depth : start.depth.pixels()) depth *= off;
    EXPECT_LT(MeanError(sphere.own, MatchSurface(sphere.problem, start, {})), 0.002);
  }
  EXPECT_LT(MeanError(sphere.own, MatchSurface(sphere.problem, *sphere.own.map, {})), 0.0015);
}

TEST(SurfaceMatching, LeavesASurfaceWithoutTextureWhereItIs) {
  SphereProblem sphere = TexturedSphere();
  SphereProblem plain({-0.3, -0.15, 0.15, 0.3});
  const Image<float> depth = MatchSurface(plain.problem, *plain.own.map, {});
  EXPECT_LT(MeanError(plain.own, depth), 1e-6);
  sphere.problem.sources.clear();
  EXPECT_LT(MeanError(sphere.own, MatchSurface(sphere.problem, *sphere.own.map, {})), 1e-6);
}

TEST(SurfaceMatching, DoesNotListenToASourceWhoseViewIsBlocked) {
  SphereProblem sphere = TexturedSphere();
  for (Source& source : sphere.problem.sources) source.map = Constant(1);  // something right in front of it
  DepthNormalMap start = *sphere.own.map;
  for (float& depth : start.depth.pixels()) depth *= 1.006f;
  EXPECT_NEAR(MeanError(sphere.own, MatchSurface(sphere.problem, start, {})), 0.006, 1e-6);
}

}  // namespace
}  // namespace polarscan
