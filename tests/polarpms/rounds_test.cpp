// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/random.h"
#include "sphere_problem.h"
#include "stereo/costs/normal_from_aop.h"
#include "stereo/rounds/integrate.h"
#include "stereo/rounds/normals.h"
#include "stereo/rounds/round.h"
#include "stereo/rounds/vote.h"

namespace polarscan {
namespace {

float AngleDegrees(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::acos(std::clamp(a.dot(b), -1.0f, 1.0f)) * 180 / std::numbers::pi_v<float>;
}

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
