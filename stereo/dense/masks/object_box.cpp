// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/object_box.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/statistics.h"

namespace polarscan {
namespace {

constexpr double kLeftOut = 1.0 / 6;  // share of the views that a bound of the box may contradict

// The rectangle of set pixels: left, top, right, bottom; none: left > right.
std::array<int, 4> RectangleAround(const Image<std::uint8_t>& mask) {
  std::array<int, 4> r{mask.width(), mask.height(), -1, -1};
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x)
      if (mask(x, y)) r = {std::min(r[0], x), std::min(r[1], y), std::max(r[2], x), std::max(r[3], y)};
  return r;
}

// The box of what a view's mask may show, along the world's axes.
ObjectBox BoxOfView(const DenseView& view, const std::array<int, 4>& rectangle) {
  ObjectBox box{Eigen::Vector3d::Constant(INFINITY), Eigen::Vector3d::Constant(-INFINITY)};
  const Rigid world_from_cam = view.cam_from_world.Inverse();
  for (const double depth : {view.depth_min, view.depth_max})
    for (const int u : {rectangle[0], rectangle[2] + 1})
      for (const int v : {rectangle[1], rectangle[3] + 1}) {
        const Eigen::Vector3d corner = world_from_cam * Eigen::Vector3d(depth * view.camera.Ray(u, v));
        box.low = box.low.cwiseMin(corner), box.high = box.high.cwiseMax(corner);
      }
  return box;
}

// What all but a few of the boxes contain.
ObjectBox Common(const std::vector<ObjectBox>& boxes) {
  const auto left_out = std::size_t(kLeftOut * double(boxes.size()));
  ObjectBox common;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> low, high;
    for (const ObjectBox& box : boxes) low.push_back(box.low[axis]), high.push_back(box.high[axis]);
    std::ranges::sort(low, std::greater<>());
    std::ranges::sort(high);
    common.low[axis] = low[left_out], common.high[axis] = high[left_out];
  }
  return common;
}

}  // namespace

double MiddlePixel(const std::vector<DenseView>& views) {
  std::vector<double> pixels;
  for (const DenseView& view : views)
    pixels.push_back((view.depth_min + view.depth_max) / 2 / view.camera.fx);
  return Median(std::move(pixels));
}

MasksBox BoxOfMasks(const std::vector<DenseView>& views, const MaskOf& mask, Progress& progress) {
  MasksBox result;
  std::vector<std::array<int, 4>> rectangles(views.size());
  ParallelFor(0, int(views.size()), [&](int i) {
    progress.Check();
    rectangles[std::size_t(i)] = RectangleAround(mask(i));
  });
  std::vector<ObjectBox> boxes;
  for (int i = 0; i < int(views.size()); ++i) {
    if (rectangles[std::size_t(i)][2] < 0) continue;
    result.masked.push_back(i);
    boxes.push_back(BoxOfView(views[std::size_t(i)], rectangles[std::size_t(i)]));
  }
  if (boxes.empty()) return result;
  const ObjectBox box = Common(boxes);
  if ((box.high - box.low).minCoeff() > 0) result.box = box;
  return result;
}

}  // namespace polarscan
