// SPDX-License-Identifier: Apache-2.0
#include "pipeline/coarse_normal.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace polarscan {

int CoarseRadius(int width, std::size_t pixels) {
  return std::max(2, int(std::lround(std::min(0.025 * width, 0.06 * std::sqrt(double(pixels))))));
}

std::optional<Eigen::Vector3d> CoarseNormal(const Image<float>& depth, const Pinhole& camera, int x, int y,
                                            int radius) {
  const int step = std::max(1, radius / 8);
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  int found = 0, asked = 0;
  for (int v = y - radius; v <= y + radius; v += step)
    for (int u = x - radius; u <= x + radius; u += step) {
      ++asked;
      if (!depth.Contains(u, v) || depth(u, v) <= 0) continue;
      const Eigen::Vector3d ray = camera.Ray(u + 0.5, v + 0.5);
      squares += ray * ray.transpose();
      right += ray / double(depth(u, v));
      ++found;
    }
  if (2 * found < asked) return {};
  const Eigen::Vector3d normal = -squares.ldlt().solve(right);
  if (!normal.allFinite() || normal.norm() == 0) return {};
  return normal.normalized();
}

}  // namespace polarscan
