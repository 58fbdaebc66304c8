// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>

#include "stereo/costs/problem.h"

namespace polarscan {

// What stays the same along a contour that polarization gives: in perspective not the depth z of a point X but its
// distance |X| from the camera, for the tangent that an AoP tells is perpendicular to the line of sight. Distances
// here are u = f log |X|, pixels, f the camera's focal length: the slope of u is the tangent of the surface's tilt
// against the line of sight, near the middle of the picture.
class LogDistance {
 public:
  explicit LogDistance(const Pinhole& camera) : focal_(std::sqrt(float(camera.fx * camera.fy))) {}
  // ray: z = 1.
  float FromDepth(float depth, const Eigen::Vector3f& ray) const {
    return focal_ * std::log(depth * ray.norm());
  }
  float ToDepth(float u, const Eigen::Vector3f& ray) const { return std::exp(u / focal_) / ray.norm(); }

 private:
  float focal_;  // pixels
};

// u of every pixel and how much it counts, 0: nothing is known there.
struct Distances {
  Image<float> u, weight;
};

}  // namespace polarscan
