// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>
#include <functional>
#include <numbers>

#include "sphere_problem.h"
#include "stereo/contours/propagate.h"
#include "stereo/costs/cost_terms.h"

namespace polarscan {
namespace {

constexpr int kMiddle = kSize / 2;

void TurnAop(PolarSample& sample) {  // by 90 degrees: as specular reflection has it
  sample.cos_phi = std::exchange(sample.sin_phi, sample.cos_phi);
  sample.cos_phi = -sample.cos_phi;
}

// The sphere of sphere_problem.h; some of its depths and normals.
class Contours : public testing::Test {
 protected:
  Contours() : sphere_({}), truth_(*sphere_.own.map), scale_(kCamera) {}

  DepthNormalMap Some(const std::function<bool(int x, int y)>& is_known) const {
    DepthNormalMap some = truth_;
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x)
        if (!is_known(x, y)) some.depth(x, y) = 0, some.normal(x, y).setZero();
    return some;
  }

  Distances AsDistances(const DepthNormalMap& map) const {
    Distances distances{Image<float>(kSize, kSize), Image<float>(kSize, kSize)};
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x)
        if (map.depth(x, y) > 0) {
          distances.u(x, y) = scale_.FromDepth(map.depth(x, y), sphere_.problem.Ray(x, y));
          distances.weight(x, y) = 1;
        }
    return distances;
  }

  // What u may be off by at a pixel: seeds are met half a pixel's diagonal away.
  static double Tolerance(const Distances& truth, int x, int y) {
    const float across = truth.u(x + 1, y) - truth.u(x - 1, y), down = truth.u(x, y + 1) - truth.u(x, y - 1);
    return 0.2 + 0.75 * std::hypot(across, down) / 2;
  }

  // Every pixel that is not too near to the rim: f(x, y).
  void ForFacing(const std::function<void(int, int)>& f) const {
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x)
        if (truth_.depth(x, y) > 0 && truth_.normal(x, y).z() < -0.5f) f(x, y);
  }

  StereoView& view() { return *sphere_.own.view; }

  SphereProblem sphere_;
  const DepthNormalMap truth_;
  const LogDistance scale_;
  Progress progress_;
};

TEST_F(Contours, ASphereWithOneRadiusKnownIsKnownAlongItsRings) {
  const Distances seeds = AsDistances(Some([](int x, int y) { return y == kMiddle && x >= kMiddle; })),
                  truth = AsDistances(truth_);
  const Image<Reflection> diffuse(kSize, kSize, Reflection::kDiffuse);
  const ContourField field(sphere_.problem, diffuse);
  TraceOptions options;
  options.seeds = 1;
  const Distances traced = TraceContours(sphere_.problem, field, seeds, options);
  int count = 0, reached = 0;
  ForFacing([&](int x, int y) {
    if (std::hypot(x - kMiddle, y - kMiddle) < 3) return;  // rings as small as the smoothing
    ++count;
    if (traced.weight(x, y) <= 0) return;
    ++reached;
    EXPECT_NEAR(traced.u(x, y), truth.u(x, y), Tolerance(truth, x, y)) << x << ' ' << y;
  });
  EXPECT_GT(count, 800);
  EXPECT_GT(reached, count * 98 / 100);
}

TEST_F(Contours, InPerspectiveTheyRunAtTheSameDistanceThoughNotTheSameDepth) {
  // A steep plane, of which the left border is known, seen at up to 45 degrees from the optical axis.
  StereoView wide;
  wide.camera = {kSize, kSize, kSize / 2.0, kSize / 2.0, kSize / 2.0, kSize / 2.0};
  wide.polar = Image<PolarSample>(kSize, kSize);
  const Problem problem{&wide, {}, 1, 9, 0};
  const Eigen::Vector3f normal = Eigen::Vector3f(0.1f, -0.6f, -1).normalized();
  const LogDistance scale(wide.camera);
  Distances truth{Image<float>(kSize, kSize), Image<float>(kSize, kSize)}, seeds = truth;
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const Eigen::Vector3f ray = problem.Ray(x, y);
      const float azimuth =
          std::atan2(-(normal.y() - normal.z() * ray.y()), normal.x() - normal.z() * ray.x());
      wide.polar(x, y) = {std::cos(azimuth), std::sin(azimuth), 1, 0.1f};
      truth.u(x, y) = scale.FromDepth(DepthOnPlane({4, normal}, {0, 0, 1}, ray), ray);
      if (x < 20) seeds.u(x, y) = truth.u(x, y), seeds.weight(x, y) = 1;
    }
  const ContourField field(problem, Image<Reflection>(kSize, kSize, Reflection::kDiffuse));
  const Distances traced = TraceContours(problem, field, seeds, {});
  int reached = 0;
  for (int y = 1; y < kSize - 1; ++y)
    for (int x = 20; x < kSize - 1; ++x)
      if (traced.weight(x, y) > 0) {
        ++reached;
        EXPECT_NEAR(traced.u(x, y), truth.u(x, y), Tolerance(truth, x, y)) << x << ' ' << y;
      }
  EXPECT_GT(reached, 700);
}

TEST_F(Contours, LabelsOfMixedReflectionAreFoundFromFewNormals) {
  const auto is_specular = [](int x, int y) { return x > y || (x > 18 && x < 24 && y > 30 && y < 36); };
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      if (is_specular(x, y)) TurnAop(view().polar(x, y));
  DepthNormalMap some = Some([](int x, int y) { return x % 7 == 0 && y % 6 == 0; });
  for (int y = 0; y < kSize; y += 30)  // a few are wrong
    for (int x = 0; x < kSize; x += 7) some.normal(x, y) = Eigen::Vector3f(0.6f, 0, -0.8f);
  const Image<Reflection> labels = LabelReflection(sphere_.problem, some.normal, {});
  int wrong = 0, count = 0;
  ForFacing([&](int x, int y) {
    ++count;
    wrong += labels(x, y) != (is_specular(x, y) ? Reflection::kSpecular : Reflection::kDiffuse);
  });
  EXPECT_LT(wrong, count / 50);  // in the middle, where azimuths turn from pixel to pixel
}

TEST_F(Contours, SparseDepthsWithOutliersOnMixedReflectionGiveTheSphere) {
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kMiddle; ++x) TurnAop(view().polar(x, y));
  DepthNormalMap some = Some([](int x, int y) { return x % 6 == 3 && y % 6 == 3; });
  for (int y = 9; y < kSize; y += 24) some.depth(27, y) *= 1.3f;
  const Propagated made = PropagateDepth(sphere_.problem, some, {}, progress_);
  double depths = 0, degrees = 0, count = 0;
  ForFacing([&](int x, int y) {
    ++count;
    depths += std::abs(made.map.depth(x, y) - truth_.depth(x, y));
    const float cosine = std::min(1.0f, made.map.normal(x, y).dot(truth_.normal(x, y)));
    degrees += std::acos(cosine) * 180 / std::numbers::pi;
  });
  EXPECT_LT(depths / count, 0.01);  // a quarter of a pixel's width on the sphere
  EXPECT_LT(degrees / count, 5);
}

TEST_F(Contours, PolarizationTellsDepthsFarFromAnySeed) {
  const DepthNormalMap some = Some([](int x, int y) { return x >= kMiddle && std::abs(y - kMiddle) < 3; });
  const auto error = [&] {
    const Propagated made = PropagateDepth(sphere_.problem, some, {}, progress_);
    double sum = 0;
    ForFacing([&](int x, int y) { sum += std::abs(made.map.depth(x, y) - truth_.depth(x, y)); });
    return sum;
  };
  const double with = error();
  view().polar = {};
  EXPECT_LT(with, 0.2 * error());
}

TEST_F(Contours, WithoutAnySeedNothingIsKnown) {
  const Propagated made =
      PropagateDepth(sphere_.problem, Some([](int, int) { return false; }), {}, progress_);
  for (const float depth : made.map.depth.pixels()) EXPECT_EQ(depth, 0);
  for (const std::uint8_t reached : made.reached.pixels()) EXPECT_EQ(reached, 0);
}

TEST_F(Contours, OneAndTwoThreadsGiveTheSameBytesOfAView) {
  const DepthNormalMap some = Some([](int x, int y) { return (3 * x + 5 * y) % 31 == 0; });
  Image<float> depth[2];
  for (int threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    depth[threads - 1] = PropagateDepth(sphere_.problem, some, {}, progress_).map.depth;
  }
  EXPECT_EQ(std::memcmp(depth[0].row(0), depth[1].row(0), depth[0].size() * sizeof(float)), 0);
}

TEST_F(Contours, ACancelEndsIt) {
  progress_.Cancel();
  EXPECT_THROW(PropagateDepth(sphere_.problem, truth_, {}, progress_), Cancelled);
}

}  // namespace
}  // namespace polarscan
