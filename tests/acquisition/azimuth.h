// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cmath>
#include <numbers>

namespace polarscan {

inline constexpr double kPi = std::numbers::pi;

// Azimuth of a normal in the camera frame, seen along (x, y, 1), anticlockwise as displayed.
inline double Azimuth(const Eigen::Vector3d& n, double x, double y) {
  return std::atan2(-(n.y() - n.z() * y), n.x() - n.z() * x);
}

}  // namespace polarscan
