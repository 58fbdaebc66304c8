// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <vector>

#include "stereo/costs/problem.h"

namespace polarscan {

inline constexpr int kSize = 60;
inline const Pinhole kCamera{kSize, kSize, 90, 90, kSize / 2.0, kSize / 2.0};

// The unit sphere at the world's origin, seen from distance 4 at an angle about the vertical axis.
struct SphereView {
  std::shared_ptr<StereoView> view = std::make_shared<StereoView>();
  std::shared_ptr<DepthNormalMap> map = std::make_shared<DepthNormalMap>();
};

inline SphereView MakeSphereView(double angle) {
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

// The same depth at every pixel, facing the camera.
inline std::shared_ptr<const DepthNormalMap> Constant(float depth) {
  DepthNormalMap map{Image<float>(kSize, kSize, depth),
                     Image<Eigen::Vector3f>(kSize, kSize, Eigen::Vector3f(0, 0, -1))};
  return std::make_shared<const DepthNormalMap>(std::move(map));
}

}  // namespace polarscan
