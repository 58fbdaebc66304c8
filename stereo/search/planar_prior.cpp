// SPDX-License-Identifier: Apache-2.0
#include "stereo/search/planar_prior.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace polarscan {
namespace {

constexpr int kBlock = 5;
constexpr float kCertainCost = 0.1f;

std::vector<cv::Point> CertainPixels(const Problem& problem, const Image<float>& cost) {
  std::vector<cv::Point> pixels;
  for (int y0 = 0; y0 < cost.height(); y0 += kBlock)
    for (int x0 = 0; x0 < cost.width(); x0 += kBlock) {
      float least = kCertainCost;
      cv::Point best(-1, -1);
      for (int y = y0; y < std::min(y0 + kBlock, cost.height()); ++y)
        for (int x = x0; x < std::min(x0 + kBlock, cost.width()); ++x)
          if (problem.Active(x, y) && cost(x, y) < least) least = cost(x, y), best = {x, y};
      if (best.x >= 0) pixels.push_back(best);
    }
  return pixels;
}

using Corners = std::array<cv::Point, 3>;

std::vector<Corners> Triangles(const std::vector<cv::Point>& pixels, int width, int height) {
  cv::Subdiv2D subdivision(cv::Rect(0, 0, width, height));
  for (const cv::Point& pixel : pixels) subdivision.insert(cv::Point2f(pixel));
  std::vector<cv::Vec6f> list;
  subdivision.getTriangleList(list);
  std::vector<Corners> triangles;
  for (const cv::Vec6f& t : list) {
    Corners corners;
    bool inside = true;
    for (int k = 0; k < 3; ++k) {
      corners[std::size_t(k)] = {int(std::lround(t[2 * k])), int(std::lround(t[2 * k + 1]))};
      inside &= cv::Rect(0, 0, width, height).contains(corners[std::size_t(k)]);
    }
    if (inside) triangles.push_back(corners);
  }
  return triangles;
}

// The plane through three points; depth: along `ray`. Depth 0: they lie on one line.
struct Plane {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float offset = 0;  // normal . X
};

Plane PlaneThrough(const Problem& problem, const Image<float>& depth, const Corners& corners) {
  std::array<Eigen::Vector3f, 3> points;
  for (std::size_t k = 0; k < 3; ++k)
    points[k] = depth(corners[k].x, corners[k].y) * problem.Ray(corners[k].x, corners[k].y);
  Plane plane{(points[1] - points[0]).cross(points[2] - points[0]), 0};
  const float length = plane.normal.norm();
  if (!(length > 0)) return {};
  plane.normal /= plane.normal.dot(points[0]) > 0 ? -length : length;
  plane.offset = plane.normal.dot(points[0]);
  return plane;
}

void Fill(const Problem& problem, const Corners& corners, const Plane& plane, DepthNormalMap& prior) {
  const auto [left, right] = std::minmax({corners[0].x, corners[1].x, corners[2].x});
  const auto [top, bottom] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
  const auto side = [](const cv::Point& a, const cv::Point& b, int x, int y) {
    return std::int64_t(b.x - a.x) * (y - a.y) - std::int64_t(b.y - a.y) * (x - a.x);
  };
  for (int y = top; y <= bottom; ++y)
    for (int x = left; x <= right; ++x) {
      const auto a = side(corners[0], corners[1], x, y), b = side(corners[1], corners[2], x, y),
                 c = side(corners[2], corners[0], x, y);
      if ((a < 0 || b < 0 || c < 0) && (a > 0 || b > 0 || c > 0)) continue;
      const float facing = plane.normal.dot(problem.Ray(x, y));
      if (facing > -1e-3f) continue;
      const float depth = plane.offset / facing;
      if (depth < problem.depth_min || depth > problem.depth_max) continue;
      prior.depth(x, y) = depth;
      prior.normal(x, y) = plane.normal;
    }
}

}  // namespace

DepthNormalMap PlanarPrior(const Problem& problem, const CostedMap& estimates) {
  const int width = estimates.cost.width(), height = estimates.cost.height();
  DepthNormalMap prior{Image<float>(width, height),
                       Image<Eigen::Vector3f>(width, height, Eigen::Vector3f::Zero())};
  for (const Corners& corners : Triangles(CertainPixels(problem, estimates.cost), width, height)) {
    const Plane plane = PlaneThrough(problem, estimates.map.depth, corners);
    if (plane.offset != 0) Fill(problem, corners, plane, prior);
  }
  return prior;
}

}  // namespace polarscan
