// SPDX-License-Identifier: Apache-2.0
#include "stereo/search/planar_prior.h"

#include <gtest/gtest.h>

#include "pipeline/stereo/schedules/enlarge.h"
#include "stereo/costs/cost_terms.h"
#include "tests/polarpms/sphere_problem.h"

namespace polarscan {
namespace {

// A plane seen by kCamera.
const Hypothesis kPlane{4, Eigen::Vector3f(0.3f, -0.2f, -1).normalized()};

float DepthAt(const Pinhole& camera, double x, double y) {
  return DepthOnPlane(kPlane, {0, 0, 1}, camera.Ray(x, y).cast<float>());
}

TEST(PlanarPrior, OfCertainPointsOnAPlaneIsThatPlane) {
  SphereProblem sphere({0.3});
  sphere.own.view->mask = {};
  CostedMap estimates{
      {Image<float>(kSize, kSize), Image<Eigen::Vector3f>(kSize, kSize, Eigen::Vector3f(0, 0, -1))},
      Image<float>(kSize, kSize, 1.0f)};
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const bool certain = (3 * x + 5 * y) % 11 == 0;
      estimates.cost(x, y) = certain ? 0.05f : 0.5f;
      estimates.map.depth(x, y) = certain ? DepthAt(kCamera, x + 0.5, y + 0.5) : 3.0f;  // the rest is wrong
    }
  const DepthNormalMap prior = PlanarPrior(sphere.problem, estimates);
  for (int y = 6; y < kSize - 6; ++y)
    for (int x = 6; x < kSize - 6; ++x) {
      EXPECT_NEAR(prior.depth(x, y), DepthAt(kCamera, x + 0.5, y + 0.5), 1e-4);
      EXPECT_GT(prior.normal(x, y).dot(kPlane.normal), 1 - 1e-5f);
    }
  std::ranges::fill(estimates.cost.pixels(), 0.2f);  // nothing is certain
  const DepthNormalMap nothing = PlanarPrior(sphere.problem, estimates);
  for (float depth : nothing.depth.pixels()) EXPECT_EQ(depth, 0);
}

TEST(Enlarged, MapsOfAPlaneAreThatPlane) {
  const Pinhole half = HalfCamera(kCamera);
  DepthNormalMap map{Image<float>(half.width, half.height),
                     Image<Eigen::Vector3f>(half.width, half.height, kPlane.normal)};
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x) map.depth(x, y) = DepthAt(half, x + 0.5, y + 0.5);
  const Image<float> gray(kSize, kSize, 0.5f), half_gray(half.width, half.height, 0.5f);
  for (const DepthNormalMap& large : {Enlarged(map, kCamera), EnlargedByGray(map, kCamera, gray, half_gray)})
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        EXPECT_NEAR(large.depth(x, y), DepthAt(kCamera, x + 0.5, y + 0.5), 1e-4);
        EXPECT_GT(large.normal(x, y).dot(kPlane.normal), 1 - 1e-5f);
      }
}

TEST(Enlarged, ByGrayAnEdgeStaysWhereThePictureHasIt) {
  const Pinhole half = HalfCamera(kCamera);
  DepthNormalMap map{Image<float>(half.width, half.height, 3.0f),
                     Image<Eigen::Vector3f>(half.width, half.height, Eigen::Vector3f(0, 0, -1))};
  Image<float> gray(kSize, kSize, 0.2f), half_gray(half.width, half.height, 0.2f);
  for (int y = 0; y < half.height; ++y)
    for (int x = half.width / 2; x < half.width; ++x) map.depth(x, y) = 5, half_gray(x, y) = 0.8f;
  for (int y = 0; y < kSize; ++y)
    for (int x = kSize / 2 - 1; x < kSize; ++x) gray(x, y) = 0.8f;  // one pixel before the coarse edge
  const DepthNormalMap large = EnlargedByGray(map, kCamera, gray, half_gray);
  EXPECT_NEAR(large.depth(kSize / 2 - 1, 20), 5, 0.05);  // the pixel that covers it has 3
  EXPECT_NEAR(large.depth(kSize / 2 - 2, 20), 3, 0.05);
}

}  // namespace
}  // namespace polarscan
