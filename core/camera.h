// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace polarscan {

// Pinhole camera without distortion or skew, in pixels; pixel centres at integer + 0.5 (docs/conventions.md).
// Camera axes: x right, y down, z forward.
struct Pinhole {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;

  Eigen::Matrix3d K() const {
    Eigen::Matrix3d k;
    k << fx, 0, cx, 0, fy, cy, 0, 0, 1;
    return k;
  }
  // Direction with z = 1 in the camera frame through the continuous image point (u, v).
  Eigen::Vector3d Ray(double u, double v) const { return {(u - cx) / fx, (v - cy) / fy, 1.0}; }
  // Image point of a camera-frame point with z > 0.
  Eigen::Vector2d Project(const Eigen::Vector3d& p) const {
    return {fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy};
  }
  // Whether an image point lies in the picture, and whether a camera-frame point shows there.
  bool Contains(const Eigen::Vector2d& at) const {
    return at.x() >= 0 && at.y() >= 0 && at.x() < width && at.y() < height;
  }
  bool Sees(const Eigen::Vector3d& p) const { return p.z() > 0 && Contains(Project(p)); }
  // The same camera looked at through a picture of another size.
  Pinhole Resized(int new_width, int new_height) const {
    const double sx = double(new_width) / width, sy = double(new_height) / height;
    return {new_width, new_height, fx * sx, fy * sy, cx * sx, cy * sy};
  }
};

// Angle between two vectors of any length, degrees in [0, 180]; exact for small angles, where an arc cosine
// is not.
inline double AngleDegrees(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

// Rigid transform target_from_source: x_target = rotation * x_source + translation.
struct Rigid {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return rotation * x + translation; }
  Rigid operator*(const Rigid& b) const {
    return {rotation * b.rotation, rotation * b.translation + translation};
  }
  Rigid Inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
  // Where the source frame's viewer stands: for cam_from_world the camera centre in the world.
  Eigen::Vector3d Center() const { return -(rotation.transpose() * translation); }
};

}  // namespace polarscan
