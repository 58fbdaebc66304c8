// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/hull_surface.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.h"
#include "stereo/costs/stereo_view.h"
#include "stereo/dense/masks/outline_steps.h"

namespace polarscan {
namespace {

constexpr float kFar = 3;  // cells: distances to the hull are not told apart beyond

// Distances to the hull at the corners of a grid's cells: positive inside, in cells.
class DistanceGrid {
 public:
  DistanceGrid(const ObjectBox& box, double side) : side_(side) {
    low_ = box.low - Eigen::Vector3d::Constant(2 * side_);
    for (int axis = 0; axis < 3; ++axis)
      count_[axis] = int(std::ceil((box.high[axis] - box.low[axis]) / side_)) + 5;
    inside_.assign(std::size_t(count_[0]) * std::size_t(count_[1]) * std::size_t(count_[2]), kFar);
  }

  // What the mask of a view leaves of it.
  void Carve(const DenseView& view, const Image<std::uint8_t>& mask) {
    const Image<float> outside = SignedDistance(mask);
    const bool whole = KeepsClearOfBorder(mask);
    ParallelFor(0, count_[2], [&](int z) {
      for (int y = 0; y < count_[1]; ++y)
        for (int x = 0; x < count_[0]; ++x) {
          const Eigen::Vector3d p = view.cam_from_world * Corner(x, y, z);
          if (p.z() <= 0) continue;
          const Eigen::Vector2d at = view.camera.Project(p);
          const auto px = Bilinear(outside, at.x(), at.y());
          const double cells = px ? -double(*px) * p.z() / (view.camera.fx * side_) : whole ? -kFar : kFar;
          float& inside = inside_[Index(x, y, z)];
          inside = std::min(inside, float(std::max(cells, -double(kFar))));
        }
    });
  }

  std::vector<HullPoint> Crossings() const {
    std::vector<std::vector<HullPoint>> of_layer;
    of_layer.resize(std::size_t(count_[2]));
    ParallelFor(1, count_[2] - 2, [&](int z) {
      for (int y = 1; y < count_[1] - 2; ++y)
        for (int x = 1; x < count_[0] - 2; ++x)
          for (int axis = 0; axis < 3; ++axis) {
            const std::array<int, 3> here{x, y, z};
            std::array<int, 3> next = here;
            ++next[std::size_t(axis)];
            AddCrossing(here, next, of_layer[std::size_t(z)]);
          }
    });
    std::vector<HullPoint> points;
    for (const auto& layer : of_layer) points.insert(points.end(), layer.begin(), layer.end());
    return points;
  }

 private:
  std::size_t Index(int x, int y, int z) const {
    return (std::size_t(z) * std::size_t(count_[1]) + std::size_t(y)) * std::size_t(count_[0]) +
           std::size_t(x);
  }
  Eigen::Vector3d Corner(int x, int y, int z) const { return low_ + side_ * Eigen::Vector3d(x, y, z); }
  float At(const std::array<int, 3>& c) const { return inside_[Index(c[0], c[1], c[2])]; }

  Eigen::Vector3f Slope(std::array<int, 3> c) const {
    Eigen::Vector3f slope;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::array<int, 3> before = c, after = c;
      --before[axis], ++after[axis];
      slope[Eigen::Index(axis)] = At(after) - At(before);
    }
    return slope;
  }

  void AddCrossing(const std::array<int, 3>& here, const std::array<int, 3>& next,
                   std::vector<HullPoint>& points) const {
    const float a = At(here), b = At(next);
    if ((a > 0) == (b > 0)) return;
    const float share = a / (a - b);
    const Eigen::Vector3f outward = -((1 - share) * Slope(here) + share * Slope(next));
    if (outward.norm() == 0) return;
    const Eigen::Vector3d from = Corner(here[0], here[1], here[2]), to = Corner(next[0], next[1], next[2]);
    points.push_back({(from + double(share) * (to - from)).cast<float>(), outward.normalized()});
  }

  double side_;
  Eigen::Vector3d low_;
  std::array<int, 3> count_{};
  std::vector<float> inside_;
};

}  // namespace

std::vector<HullPoint> HullSurface(const std::vector<DenseView>& views, const MaskOf& mask,
                                   Progress& progress) {
  const auto [masked, box] = BoxOfMasks(views, mask, progress);
  if (!box) return {};
  DistanceGrid grid(*box, std::max((box->high - box->low).maxCoeff() / kHullCells, MiddlePixel(views)));
  for (const int view : masked) {
    progress.Check();
    grid.Carve(views[std::size_t(view)], mask(view));
  }
  return grid.Crossings();
}

}  // namespace polarscan
