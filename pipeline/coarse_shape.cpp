// SPDX-License-Identifier: Apache-2.0
#include "pipeline/coarse_shape.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "fusion/cloud/maps.h"

namespace polarscan {

namespace {

constexpr int kMostAsked = 40;

// Small beside the picture and beside an object of so many pixels.
int RadiusFor(int width, std::size_t pixels) {
  return std::max(2, int(std::lround(std::min(0.025 * width, 0.06 * std::sqrt(double(pixels))))));
}

// Of the plane through the depths within `radius` pixels (inverse depth is linear on a plane); none if fewer
// than half of them are there.
std::optional<Eigen::Vector3d> NormalAround(const Image<float>& depth, const Pinhole& camera, int x, int y,
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

}  // namespace

std::vector<int> SomeViews(const Workspace& workspace, const MapKind& kind) {
  std::vector<int> with_maps, some;
  for (int i = 0; i < int(workspace.views.size()); ++i)
    if (HasMaps(workspace, i, kind)) with_maps.push_back(i);
  const std::size_t count = std::min<std::size_t>(with_maps.size(), kMostAsked);
  for (std::size_t i = 0; i < count; ++i) some.push_back(with_maps[i * with_maps.size() / count]);
  return some;
}

std::vector<CoarseNormal> CoarseNormals(const Image<float>& depth, const Pinhole& camera, int count,
                                        Random random) {
  std::vector<int> pixels;
  for (std::size_t i = 0; i < depth.size(); ++i)
    if (depth.pixels()[i] > 0) pixels.push_back(int(i));
  std::vector<CoarseNormal> normals;
  if (pixels.empty()) return normals;
  const int radius = RadiusFor(depth.width(), pixels.size());
  for (int i = 0; i < count; ++i) {
    const int pixel = pixels[random.Below(std::uint32_t(pixels.size()))], x = pixel % depth.width(),
              y = pixel / depth.width();
    if (const auto normal = NormalAround(depth, camera, x, y, radius)) normals.push_back({x, y, *normal});
  }
  return normals;
}

}  // namespace polarscan
