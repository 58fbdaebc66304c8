// SPDX-License-Identifier: Apache-2.0
#include "stereo/costs/cost_terms.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/random.h"
#include "stereo/costs/hypotheses.h"
#include "stereo/costs/pixel_cost.h"
#include "stereo/search/visibility.h"
#include "tests/polarpms/sphere_problem.h"

namespace polarscan {
namespace {

using Eigen::Vector3f;
constexpr double kPi = std::numbers::pi;

// Azimuth as displayed (anticlockwise from +x) of a normal at normalised pixel (x, y): docs/conventions.md.
double Azimuth(const Vector3f& n, float x, float y) {
  return std::atan2(-(n.y() - n.z() * y), n.x() - n.z() * x);
}

// eta of eq. (8): distance of alpha - phi to the nearest multiple of 90 degrees.
double Eta(double alpha, double phi) {
  const double d = std::abs(std::remainder(alpha - phi, kPi / 2));
  return d;
}

PolarSample Sample(double phi) { return {float(std::cos(phi)), float(std::sin(phi)), 1, 0.1f}; }

TEST(PolarizationResidual, IsTheSquaredSineOfTwiceEta) {
  StereoOptions options;
  options.polarization_residual = "sine";
  const PolarizationResidual residual(options);
  for (std::uint64_t i = 0; i < 200; ++i) {
    Random random(3, i);
    const float x = random.Uniform(-0.4f, 0.4f), y = random.Uniform(-0.4f, 0.4f);
    const Vector3f n = RandomNormal({x, y, 1}, random);
    const double phi = random.Uniform(0, float(kPi));
    EXPECT_NEAR(residual(Sample(phi), n, x, y), std::pow(std::sin(2 * Eta(Azimuth(n, x, y), phi)), 2), 2e-4);
  }
}

TEST(PolarizationResidual, ExponentialFormHasThePublishedShape) {
  StereoOptions options;
  options.polarization_residual = "exponential";
  options.residual_steepness = 0.5;
  const PolarizationResidual residual(options);
  const Vector3f n(1, 0, -0.5f);  // azimuth 0 in the picture's centre
  // u = (exp(-k theta) - exp(-k)) / (1 - exp(-k)), theta = 1 - 4 eta / pi, at eta = 0, 11.25, 22.5, 33.75, 45
  // degrees
  const double expected[] = {0, 0.2077, 0.4378, 0.6993, 1};
  for (int i = 0; i < 5; ++i) {
    EXPECT_NEAR(residual(Sample(i * kPi / 16), n, 0, 0), expected[i], 6e-3) << i;
    EXPECT_NEAR(residual(Sample(i * kPi / 16 + kPi / 2), n, 0, 0), expected[i], 6e-3) << i;
  }
  options.residual_power = 2;
  EXPECT_NEAR(PolarizationResidual(options)(Sample(kPi / 8), n, 0, 0), expected[2] * expected[2], 6e-3);
}

TEST(PolarimetricCost, PublishedFormIgnoresViewsWithoutPolarizationAndNoiseFormFades) {
  PolarSample strong = Sample(0), none = Sample(0);
  none.weight = 0;
  PolarimetricCost published(true), fading(false);
  for (PolarimetricCost* cost : {&published, &fading}) {
    cost->Add(strong, 0.8f, 1);
    cost->Add(none, 0.1f, 3);
  }
  EXPECT_FLOAT_EQ(published.Value(), 0.8f);
  EXPECT_FLOAT_EQ(fading.Value(), 0.2f);
  EXPECT_EQ(PolarimetricCost(true).Value(), 0);  // no evidence at all: the term vanishes
}

TEST(PixelCost, ASourceThatDoesNotSeeThePointCountsOnlyIfAskedTo) {
  SphereProblem sphere({0.9});
  StereoOptions options = StereoPreset("paper");
  options.depth_normal = false;
  const int x = 30, y = 24;
  const Hypothesis truth{sphere.own.map->depth(x, y), sphere.own.map->normal(x, y).normalized()};
  sphere.problem.sources[0].map = nullptr;  // no geometric term
  const auto polarization = [&](double depth, bool count_unseen) {
    options.count_unseen = count_unseen;
    const PixelCost cost(sphere.problem, options);
    PixelContext pixel;
    cost.Place(x, y, pixel);
    pixel.chosen[0] = {0, 1, 1};
    pixel.chosen_count = 1;
    const float matches = 0;  // known: no photometric cost
    return cost.Total(pixel, {float(depth), truth.normal}, &matches, 1e30f) /
           float(options.polarization_weight);
  };
  for (bool count_unseen : {false, true}) EXPECT_LT(polarization(truth.depth, count_unseen), 0.01f);
  // There the source sees background; beyond, the point is outside of its picture. The reference's own AoP fits.
  for (double depth : {6.0, 40.0}) {
    EXPECT_NEAR(polarization(depth, false), 0, 1e-3);
    EXPECT_NEAR(polarization(depth, true), 0.5, 1e-3);
  }
}

// A hypothesis near the truth on a sphere without texture, with all terms on.
struct NearTruth {
  explicit NearTruth(const std::string& preset) : options(StereoPreset(preset)) {
    options.depth_normal_weight = 0.4;
    for (Source& source : sphere.problem.sources)
      source.map = MakeSphereView(0.3).map;  // any: for the geometric term
  }
  void Prepare(const PixelCost& cost, PixelContext& pixel) const {
    cost.Place(30, 24, pixel);
    for (std::size_t s = 0; s < 2; ++s) pixel.chosen[s] = {s, s ? 0.25f : 0.75f, s ? 5.f : 15.f};
    pixel.chosen_count = 2;
    const auto at = [&](int x, int y) {
      return Neighbour{{sphere.own.map->depth(x, y), sphere.own.map->normal(x, y)}, sphere.problem.Ray(x, y)};
    };
    pixel.neighbours = {at(29, 24), at(31, 24), at(30, 23), at(30, 25)};
  }
  SphereProblem sphere{{0.3, -0.4}};
  StereoOptions options;
};

TEST(PixelCost, TermsAddUpToTheWhole) {
  for (const char* preset : {"paper", "default"}) {
    const NearTruth near(preset);
    const PixelCost cost(near.sphere.problem, near.options);
    PixelContext pixel;
    near.Prepare(cost, pixel);
    for (double depth : {3.0, 3.05, 5.2, 40.0}) {  // on it, beside it, on a source's background, out of it
      const Hypothesis hypothesis{float(depth), Vector3f(0.2f, -0.1f, -1).normalized()};
      std::array<float, kMaxTerms> terms;
      const std::size_t count = cost.Terms(pixel, hypothesis, terms.data());
      EXPECT_EQ(count, cost.TermCount(pixel));
      const float whole = cost.Total(pixel, hypothesis, nullptr, 1e30f);
      EXPECT_NEAR(std::accumulate(terms.begin(), terms.begin() + std::ptrdiff_t(count), 0.0f), whole,
                  1e-5f * whole);
    }
  }
}

TEST(NormalFromAop, RecoversTheNormalFromExactAnglesOfSeveralViews) {
  for (std::uint64_t i = 0; i < 50; ++i) {
    Random random(11, i);
    const Vector3f ray(0.1f, -0.05f, 1);
    Vector3f normal = RandomNormal(ray, random);
    if (normal.dot(ray.normalized()) > -0.3f) continue;
    std::vector<AopConstraint> constraints;
    for (int k = 0; k < 5; ++k) {
      const Eigen::Matrix3f turn = (Eigen::AngleAxisf(random.Uniform(-0.5f, 0.5f), Vector3f::UnitX()) *
                                    Eigen::AngleAxisf(random.Uniform(-0.5f, 0.5f), Vector3f::UnitY()))
                                       .toRotationMatrix();
      const float x = random.Uniform(-0.2f, 0.2f), y = random.Uniform(-0.2f, 0.2f);
      const Vector3f seen = turn * normal;
      const double phi = Azimuth(seen, x, y) + (k % 2 ? kPi / 2 : 0);  // diffuse and specular views mixed
      AopConstraint constraint = MakeAopConstraint(Sample(phi), x, y);
      constraint.diffuse = turn.transpose() * constraint.diffuse;
      constraint.specular = turn.transpose() * constraint.specular;
      constraints.push_back(constraint);
    }
    Random small(12, i);
    const Vector3f start = PerturbedNormal(normal, ray, 0.05f, small);
    const Vector3f found = NormalFromAop(constraints, AopLabels::kFromNormal, start, ray);
    EXPECT_GT(found.dot(normal), std::cos(0.01f)) << i;
  }
}

TEST(NormalFromAop, KeepsTheStartWhereOneViewAloneCannotDecide) {
  const AopConstraint only = MakeAopConstraint(Sample(0.4), 0, 0);
  const Vector3f start(0, 0, -1);
  EXPECT_EQ(NormalFromAop({&only, 1}, AopLabels::kFromNormal, start, {0, 0, 1}), start);
}

TEST(DepthNormal, VanishesOnAPlaneAndPunishesATiltedNormal) {
  const Vector3f n = Vector3f(0.4f, 0.1f, -1).normalized(), centre(0, 0, 1);
  const auto on_plane = [&](float x, float y) {
    const Vector3f ray(x, y, 1);
    return Neighbour{{DepthOnPlane({3, n}, centre, ray), n}, ray};
  };
  const float step = 1 / 800.0f;
  const Neighbour left = on_plane(-step, 0), above = on_plane(0, -step);
  const Hypothesis right{3, n}, tilted{3, Vector3f(-0.4f, 0.1f, -1).normalized()};
  EXPECT_NEAR(DepthNormalAngle(right, centre, left, above), 0, 1e-3);
  EXPECT_NEAR(DepthNormalAngle(tilted, centre, left, above), 1 - tilted.normal.dot(n), 1e-2);
}

TEST(GeometricError, IsZeroForAgreeingMapsAndTheDisplacementForOthers) {
  StereoView reference, other;
  reference.camera = other.camera = {200, 160, 250, 250, 100, 80};
  other.cam_from_world.translation = {-0.5, 0, 0};  // one half to the right
  other.packed.width = 200, other.packed.height = 160;
  auto map = std::make_shared<DepthNormalMap>();
  map->depth = Image<float>(200, 160, 5.0f);
  const Source source = MakeSource(reference, std::make_shared<StereoView>(other), map);
  const Vector3f ray = reference.camera.Ray(120.5, 70.5).cast<float>();
  const auto error = [&](float depth) {
    return GeometricError(reference.camera, source, Look(source, depth * ray), ray, 3);
  };
  EXPECT_NEAR(error(5), 0, 1e-4);
  // at depth d the source is met 0.5 f (1/d - 1/5) pixels beside; going back over its depth 5 shows that
  // distance
  EXPECT_NEAR(error(5.05f), 0.5 * 250 * std::abs(1 / 5.05 - 1 / 5.0), 1e-3);
  EXPECT_EQ(error(0.5f), 3);  // outside of the source's picture
}

// Probability of "visible" at each pixel of a chain by summing over all 2^n state sequences.
std::vector<double> Enumerate(const std::vector<float>& costs, const Visibility& visibility) {
  const int n = int(costs.size());
  std::vector<double> visible(costs.size());
  double total = 0;
  for (int states = 0; states < (1 << n); ++states) {
    double p = 0.5;
    for (int i = 0; i < n; ++i) {
      const bool seen = states >> i & 1;
      const bool changes =
          (states ^ states >> 1) >> (i - 1) & 1;  // comparing two bits GCC 12 makes wrong code of
      if (i > 0) p *= changes ? 1e-5 : 1 - 1e-5;
      p *= seen ? visibility.Likelihood(costs[std::size_t(i)]) : 0.5;
    }
    total += p;
    for (int i = 0; i < n; ++i)
      if (states >> i & 1) visible[std::size_t(i)] += p;
  }
  for (double& v : visible) v /= total;
  return visible;
}

TEST(Visibility, MessagesGiveTheChainsExactForwardProbability) {
  const Visibility visibility(0.6);
  const std::vector<float> costs{0.1f, 0.3f, 0.8f, 1.4f, 0.9f};
  float forward = 0.5f;
  for (float cost : costs) forward = visibility.Forward(cost, forward);
  EXPECT_NEAR(forward, Enumerate(costs, visibility).back(), 1e-5);
}

TEST(Visibility, LikelihoodIsADensityOverTheCostsRange) {
  const Visibility visibility(0.6);
  double area = 0;
  for (int i = 0; i < 2000; ++i) area += visibility.Likelihood(float((i + 0.5) / 1000)) / 1000;
  EXPECT_NEAR(area, 1, 1e-4);
}

TEST(DrawSources, DrawsInProportionAndCountsEverySourceOnceWithoutWeights) {
  Random random(5);
  const std::vector<float> weights{1, 0, 3};
  std::vector<int> counts(3);
  DrawSources(weights, 40000, random, counts);
  EXPECT_EQ(counts[1], 0);
  EXPECT_NEAR(counts[2] / 40000.0, 0.75, 0.01);
  DrawSources(std::vector<float>{0, 0, 0}, 10, random, counts);
  EXPECT_EQ(counts, (std::vector<int>{1, 1, 1}));
}

}  // namespace
}  // namespace polarscan
