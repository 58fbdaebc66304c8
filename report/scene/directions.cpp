// SPDX-License-Identifier: Apache-2.0
#include "report/scene/directions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/camera.h"

namespace polarscan {
namespace {

constexpr double kRadians = std::numbers::pi / 180, kGridDeg = 5, kNextTo = 7.5, kStraight = 65;

// A whole number of fives: more would claim to know where the user stands.
int Rounded(double degrees) { return int(5 * std::lround(std::abs(degrees) / 5)); }

std::vector<Eigen::Vector3d> CubeDirections() {
  std::vector<Eigen::Vector3d> directions;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x || y || z) directions.push_back(Eigen::Vector3d(x, y, z).normalized());
  return directions;
}

}  // namespace

Eigen::Vector3d Direction(double azimuth_deg, double elevation_deg) {
  const double a = azimuth_deg * kRadians, e = elevation_deg * kRadians;
  return {std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a)};
}

double AzimuthDeg(const Eigen::Vector3d& d) {
  const double degrees = std::atan2(d.x(), d.z()) / kRadians;
  return degrees < 0 ? degrees + 360 : degrees;
}

double ElevationDeg(const Eigen::Vector3d& d) { return std::asin(std::clamp(d.y(), -1., 1.)) / kRadians; }

double ToNearestCamera(const Eigen::Vector3d& direction, const std::vector<CameraPlace>& cameras) {
  double nearest = 180;
  for (const CameraPlace& camera : cameras)
    nearest = std::min(nearest, AngleDegrees(direction, camera.direction));
  return nearest;
}

std::string Where(const Eigen::Vector3d& direction, const std::vector<CameraPlace>& cameras) {
  const double elevation = ElevationDeg(direction);
  if (elevation > kStraight) return "straight above";
  if (elevation < -kStraight) return "straight below";
  const auto& nearest = *std::ranges::min_element(
      cameras, {}, [&](const CameraPlace& camera) { return AngleDegrees(direction, camera.direction); });
  const double right = std::remainder(AzimuthDeg(direction) - AzimuthDeg(nearest.direction), 360);
  const double up = elevation - ElevationDeg(nearest.direction);
  const std::string height = fmt::format("{} degrees {}", Rounded(up), up > 0 ? "higher" : "lower");
  if (std::abs(right) < kNextTo)
    return std::abs(up) < kNextTo ? "where " + nearest.name + " is" : height + " than " + nearest.name;
  std::string where =
      fmt::format("{} degrees to the {} of {}", Rounded(right), right > 0 ? "right" : "left", nearest.name);
  return std::abs(up) < kNextTo ? where : where + " and " + height;
}

std::vector<Eigen::Vector3d> EmptyDirections(const std::vector<CameraPlace>& cameras, double lowest_deg,
                                             double gap_deg, int most) {
  std::vector<Eigen::Vector3d> grid;
  for (double elevation = lowest_deg; elevation <= 90; elevation += kGridDeg)
    for (double azimuth = 0; azimuth < 360; azimuth += kGridDeg)
      grid.push_back(Direction(azimuth, elevation));
  std::vector<CameraPlace> all = cameras;
  std::vector<Eigen::Vector3d> empty;
  while (int(empty.size()) < most) {
    double farthest = gap_deg;
    Eigen::Vector3d best = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& d : grid)
      if (const double degrees = ToNearestCamera(d, all); degrees > farthest + 1e-9)
        farthest = degrees, best = d;
    if (best.isZero()) break;
    empty.push_back(best);
    all.push_back({-1, "", best});
  }
  return empty;
}

Eigen::Vector3d MainDirection(const std::vector<Eigen::Vector3d>& normals) {
  const std::vector<Eigen::Vector3d> groups = CubeDirections();
  std::vector<Eigen::Vector3d> sums(groups.size(), Eigen::Vector3d::Zero());
  std::vector<int> counts(groups.size());
  for (const Eigen::Vector3d& n : normals) {
    const auto nearest = std::ranges::max_element(groups, {}, [&](const auto& g) { return g.dot(n); });
    const auto group = std::size_t(nearest - groups.begin());
    sums[group] += n;
    ++counts[group];
  }
  return sums[std::size_t(std::ranges::max_element(counts) - counts.begin())].normalized();
}

}  // namespace polarscan
