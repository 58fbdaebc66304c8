// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "core/random.h"
#include "stereo/costs/aop_table.h"
#include "stereo/rounds/band_rows.h"
#include "stereo/rounds/integrate.h"
#include "stereo/rounds/normals.h"
#include "stereo/rounds/round.h"
#include "stereo/rounds/surface_matching.h"
#include "stereo/rounds/vote.h"

namespace polarscan {
namespace {

constexpr int kSize = 60;
const Pinhole kCamera{kSize, kSize, 90, 90, kSize / 2.0, kSize / 2.0};

float AngleDegrees(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::acos(std::clamp(a.dot(b), -1.0f, 1.0f)) * 180 / std::numbers::pi_v<float>;
}

// The unit sphere at the world's origin, seen from distance 4 at an angle about the vertical axis.
struct SphereView {
  std::shared_ptr<StereoView> view = std::make_shared<StereoView>();
  std::shared_ptr<DepthNormalMap> map = std::make_shared<DepthNormalMap>();
};

SphereView MakeSphereView(double angle) {
  SphereView sphere;
  StereoView& view = *sphere.view;
  view.camera = kCamera;
  view.cam_from_world.rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
  view.cam_from_world.translation = {0, 0, 4};
  view.gray = Image<float>(kSize, kSize, 0.5f);
  view.packed = Pack(view.gray);
  view.polar = Image<PolarSample>(kSize, kSize);
  view.mask = Image<std::uint8_t>(kSize, kSize);
  *sphere.map = {Image<float>(kSize, kSize), Image<Eigen::Vector3f>(kSize, kSize, Eigen::Vector3f::Zero())};
  const Eigen::Vector3d center(0, 0, 4);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const Eigen::Vector3d ray = kCamera.Ray(x + 0.5, y + 0.5);
      const double a = ray.squaredNorm(), b = ray.dot(center), c = 15;
      if (b * b < a * c) continue;
      const double depth = (b - std::sqrt(b * b - a * c)) / a;
      const Eigen::Vector3d n = depth * ray - center;
      const double azimuth = std::atan2(-(n.y() - n.z() * ray.y()), n.x() - n.z() * ray.x());
      view.mask(x, y) = 255;
      view.polar(x, y) = {float(std::cos(azimuth)), float(std::sin(azimuth)), 1, 0.1f};
      sphere.map->depth(x, y) = float(depth);
      sphere.map->normal(x, y) = n.cast<float>();
    }
  return sphere;
}

// A reference view and its sources on the sphere.
struct SphereProblem {
  explicit SphereProblem(const std::vector<double>& angles) : own(MakeSphereView(0)) {
    problem.reference = own.view.get();
    problem.depth_min = 2.5f, problem.depth_max = 5.5f;
    for (double angle : angles) {
      const SphereView other = MakeSphereView(angle);
      problem.sources.push_back(MakeSource(*own.view, other.view, other.map));
    }
  }
  SphereView own;
  Problem problem;
};

TEST(Vote, RepairsWrongDepthsOfOneViewFromTheOthers) {
  SphereProblem sphere({-0.5, -0.3, -0.15, 0.15, 0.3, 0.5});
  DepthNormalMap damaged = *sphere.own.map;
  for (int y = 0; y < kSize; ++y)
    for (int x = y % 3; x < kSize; x += 3)
      if (damaged.depth(x, y) > 0) damaged.depth(x, y) *= x % 2 ? 1.2f : 0.9f;
  const Vote vote = VoteForDepth(sphere.problem, damaged, {});
  int off = 0, count = 0;
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const float truth = sphere.own.map->depth(x, y);
      // The rim is seen by few views.
      if (truth <= 0 || sphere.own.map->normal(x, y).z() > -0.5f) continue;
      ++count;
      off += std::abs(vote.depth(x, y) - truth) > 0.01f;
    }
  EXPECT_GT(count, 500);
  EXPECT_LT(off, count / 50);
}

std::shared_ptr<const DepthNormalMap> Constant(float depth) {
  DepthNormalMap map{Image<float>(kSize, kSize, depth),
                     Image<Eigen::Vector3f>(kSize, kSize, Eigen::Vector3f(0, 0, -1))};
  return std::make_shared<const DepthNormalMap>(std::move(map));
}

TEST(Vote, AThinPartInFrontKeepsItsPlaceAndALonelyDepthDoesNot) {
  // Three views say 2 at a pixel where six say 3, and one says 1.
  SphereProblem sphere({0, 0, 0, 0, 0, 0, 0, 0, 0});
  for (std::size_t s = 0; s < 9; ++s) sphere.problem.sources[s].map = Constant(s < 3 ? 2.0f : 3.0f);
  const Vote vote = VoteForDepth(sphere.problem, *Constant(1), {0.006f, 0.4f});
  EXPECT_NEAR(vote.depth(kSize / 2, kSize / 2), 2, 0.01);
  EXPECT_NEAR(vote.confidence(kSize / 2, kSize / 2), 3, 0.1);
}

TEST(Vote, ANearerModeWithLittleSupportWinsByTrustUnlessTooManySeeThroughIt) {
  // Two views say 2, six say 3 from the same place, so these six see through the surface at 2.
  SphereProblem sphere({0, 0, 0, 0, 0, 0, 0, 0});
  for (std::size_t s = 0; s < 8; ++s) sphere.problem.sources[s].map = Constant(s < 2 ? 2.0f : 3.0f);
  for (const auto& [trust, depth] : {std::pair{0.0f, 3.0f}, {0.5f, 3.0f}, {0.3f, 2.0f}}) {
    const Vote vote = VoteForDepth(sphere.problem, *Constant(3), {0.006f, 0.4f, trust});
    EXPECT_NEAR(vote.depth(kSize / 2, kSize / 2), depth, 0.01) << trust;
  }
}

TEST(Round, OnlyWithoutAMaskIsANearerSurfaceWithLittleSupportTrusted) {
  // As above: two views say 2, six say 3.
  SphereProblem sphere({0, 0, 0, 0, 0, 0, 0, 0});
  for (std::size_t s = 0; s < 8; ++s) sphere.problem.sources[s].map = Constant(s < 2 ? 2.0f : 3.0f);
  StereoOptions options;
  options.vote_trust = 0.3, options.depth_normal = false;
  sphere.own.view->polar = {};
  EXPECT_NEAR(RunRound(sphere.problem, *Constant(3), options, 1).map.depth(kSize / 2, kSize / 2), 3, 0.01);
  sphere.own.view->mask = {};
  EXPECT_NEAR(RunRound(sphere.problem, *Constant(3), options, 1).map.depth(kSize / 2, kSize / 2), 2, 0.01);
}

TEST(Integration, FindsTheSphereFromItsNormalsAndFewDepths) {
  const SphereView sphere = MakeSphereView(0);
  Image<float> rough = sphere.map->depth, confidence(kSize, kSize);
  Random random(1);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      if (rough(x, y) <= 0) continue;
      rough(x, y) *= random.Uniform(0.995f, 1.005f);
      confidence(x, y) = 2;
    }
  IntegrationOptions options;
  options.iterations = 300;
  const Image<float> depth = IntegrateNormals(kCamera, rough, confidence, sphere.map->normal, rough, options);
  double before = 0, after = 0, count = 0;
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const float truth = sphere.map->depth(x, y);
      if (truth <= 0 || sphere.map->normal(x, y).z() > -0.5f) continue;
      before += std::abs(rough(x, y) - truth), after += std::abs(depth(x, y) - truth), ++count;
    }
  EXPECT_LT(after, before / 4);
  EXPECT_LT(after / count, 0.002);
}

TEST(Integration, ChangesNothingThatFitsItsNormals) {
  // A plane's log z is not linear in the pixel, but the mean of both slopes is right to second order.
  const Eigen::Vector3f normal = Eigen::Vector3f(0.4f, -0.2f, -1).normalized();
  Image<float> depth(kSize, kSize), confidence(kSize, kSize, 1.0f);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      depth(x, y) = normal.z() * 3 / normal.dot(kCamera.Ray(x + 0.5, y + 0.5).cast<float>());
  const Image<float> result = IntegrateNormals(
      kCamera, depth, confidence, Image<Eigen::Vector3f>(kSize, kSize, normal), depth, IntegrationOptions{});
  for (std::size_t i = 0; i < depth.size(); ++i)
    EXPECT_NEAR(result.pixels()[i], depth.pixels()[i], 2e-4f * depth.pixels()[i]);
}

TEST(Normals, OfADepthMapFollowTheSphere) {
  const SphereProblem sphere({});
  const Image<Eigen::Vector3f> normals = DepthNormals(sphere.problem, sphere.own.map->depth);
  for (int y = 10; y < kSize - 10; ++y)
    for (int x = 10; x < kSize - 10; ++x)
      if (sphere.own.map->normal(x, y).z() < -0.7f) {
        EXPECT_LT(AngleDegrees(normals(x, y), sphere.own.map->normal(x, y)), 3) << x << " " << y;
      }
}

TEST(Normals, AreFoundFromTheAnglesOfPolarizationThoughAllStartsAreWrong) {
  const SphereProblem sphere({-0.5, -0.3, 0.3, 0.5});
  Image<Eigen::Vector3f> start = sphere.own.map->normal;
  Random random(2);
  for (Eigen::Vector3f& n : start.pixels())
    if (n.squaredNorm() > 0.5f)
      n = (n + 0.35f * Eigen::Vector3f(random.Uniform(-1, 1), random.Uniform(-1, 1), 0)).normalized();
  const Image<Eigen::Vector3f> solved = SolveNormals(sphere.problem, sphere.own.map->depth, start, {});
  double before = 0, after = 0, count = 0;
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const Eigen::Vector3f& truth = sphere.own.map->normal(x, y);
      if (truth.z() > -0.5f) continue;
      before += AngleDegrees(start(x, y), truth), after += AngleDegrees(solved(x, y), truth), ++count;
    }
  EXPECT_GT(before / count, 8);
  EXPECT_LT(after / count, 1.5);
}

// m.n of a noisy constraint is least for a normal that turns to the camera.
TEST(Normals, AreNotTurnedToTheCamerasByNoiseOfTheAnglesOfPolarization) {
  const std::vector<double> angles = {-0.8, -0.6, -0.4, -0.2, 0.2, 0.4, 0.6, 0.8};
  SphereProblem sphere(angles);
  Random random(3);
  const auto disturb = [&](StereoView& view) {
    for (PolarSample& sample : view.polar.pixels()) {
      const float phi = std::atan2(sample.sin_phi, sample.cos_phi) + 0.2f * float(random.Normal());
      sample.cos_phi = std::cos(phi), sample.sin_phi = std::sin(phi);
    }
  };
  disturb(*sphere.own.view);
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const SphereView other = MakeSphereView(angles[i]);
    disturb(*other.view);
    sphere.problem.sources[i] = MakeSource(*sphere.own.view, other.view, other.map);
  }
  NormalOptions options;
  options.agreement = options.depth_normal = options.consensus = options.tangent = 0;
  const DepthNormalMap& truth = *sphere.own.map;
  const Image<Eigen::Vector3f> solved = SolveNormals(sphere.problem, truth.depth, truth.normal, options);
  double turned = 0, count = 0;  // towards the camera, degrees
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const Eigen::Vector3f ray = sphere.problem.Ray(x, y).normalized();
      const float tilt = AngleDegrees(truth.normal(x, y), -ray);
      if (truth.depth(x, y) <= 0 || tilt < 30 || tilt > 60) continue;
      turned += tilt - AngleDegrees(solved(x, y), -ray), ++count;
    }
  EXPECT_GT(count, 300);
  EXPECT_LT(std::abs(turned / count), 1);
}

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
  constexpr int kWidth = 37, kTop = 3, kBottom = 21, kBegin = 6, kEnd = 19;
  const std::vector<float> taps = {0.4f, 0.2f, 0.1f};
  const Image<float> picture = [] {
    Image<float> image(50, 40);
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 50; ++x) image(x, y) = 0.5f + 0.4f * std::sin(0.3f * float(x) + 0.2f * float(y));
    return image;
  }();
  BandPlane x(kTop, kBottom, kWidth), y = x, z = x, seen = x, drawn = x, scratch = x, sums = x;
  Random random(5);
  for (int row = kTop; row < kBottom; ++row)
    for (int i = 0; i < kWidth; ++i) {
      z.Row(row)[i] = 2 + 0.01f * float(i), seen.Row(row)[i] = random.Uniform(0, 1) < 0.8 ? 1.0f : 0.0f;
      x.Row(row)[i] = z.Row(row)[i] * (float(i) - 18) / 50,
      y.Row(row)[i] = z.Row(row)[i] * float(row - 11) / 50;
    }
  const RowCamera camera{45, 45, 25, 20, 0.02f, -0.03f, 0.1f};
  for (int row = kTop; row < kBottom; ++row)
    DrawRow(picture, camera, 1.02f, x.Row(row), y.Row(row), z.Row(row), seen.Row(row), kWidth,
            drawn.Row(row));
  WindowSums(drawn, z, taps, kBegin, kEnd, scratch, sums);
  for (int row = kBegin; row < kEnd; ++row)
    for (int i = 0; i < kWidth; ++i) {
      double expected = 0;
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx)
          if (i + dx >= 0 && i + dx < kWidth && row + dy >= kTop && row + dy < kBottom)
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
  std::vector<float> w(kWidth, 2), r(kWidth), rr(kWidth), s(kWidth), ss(kWidth), rs(kWidth),
      cost(kWidth + 16);
  for (std::vector<float>* sum : {&w, &r, &rr, &s, &ss, &rs}) sum->resize(kWidth + 16, 1);
  for (int i = 0; i < kWidth; ++i) {
    const std::size_t k = std::size_t(i);
    r[k] = float(random.Uniform(-1, 1)), s[k] = float(random.Uniform(-1, 1));
    rr[k] = r[k] * r[k] / 2 + 1, ss[k] = s[k] * s[k] / 2 + 3,
    rs[k] = r[k] * s[k] / 2 + float(random.Uniform(-1, 1));
  }
  MatchingCostRow({w.data(), r.data(), rr.data(), s.data(), ss.data(), rs.data()}, 1e-5f, kWidth,
                  cost.data());
  for (int i = 0; i < kWidth; ++i) {
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

TEST(AopTable, VectorsAgreeWithTheScalarReference) {
  for (std::uint64_t n = 0; n < 200; ++n) {
    Random random(5, n);
    const auto direction = [&] {
      return Eigen::Vector3f(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1))
          .normalized();
    };
    AopTable table;
    for (std::uint64_t i = 0; i < n % 70; ++i) table.Add({direction(), direction(), random.Uniform(0, 1)});
    table.Pad();
    const Eigen::Vector3f normal = direction();
    const Eigen::Matrix3f system = AopSystemScalar(table, normal, 0.02f);
    EXPECT_LT((AopSystemSimd(table, normal, 0.02f) - system).norm(), 1e-5f * (1 + system.norm()));
    const float energy = AopEnergyScalar(table, normal, 0.02f);
    EXPECT_NEAR(AopEnergySimd(table, normal, 0.02f), energy, 1e-5f * (1 + energy));
  }
}

}  // namespace
}  // namespace polarscan
