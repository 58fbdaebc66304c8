// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/depth_range.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr std::size_t kEnoughPoints = 30;
constexpr int kRays = 40, kDepths = 200;  // samples of the hull: rays a side of the mask's box, depths a ray
constexpr int kJudges = 36;               // other masks that are asked
constexpr double kInside = 0.9;           // share of them that must agree
constexpr double kMargin = 0.15;          // of the hull's extent, added to both ends

DepthRange Percentiles(std::vector<double>& depths, double low, double high) {
  std::ranges::sort(depths);
  const double last = double(depths.size() - 1);
  return {depths[std::size_t(low * last)], depths[std::size_t(std::ceil(high * last))]};
}

// Up to kJudges other views with masks, spread evenly over all of them.
std::vector<int> Judges(const std::vector<CoarseMask>& masks, int index) {
  std::vector<int> all, chosen;
  for (int i = 0; i < int(masks.size()); ++i)
    if (i != index && !masks[std::size_t(i)].cells.empty()) all.push_back(i);
  const std::size_t count = std::min<std::size_t>(all.size(), kJudges);
  for (std::size_t k = 0; k < count; ++k) chosen.push_back(all[k * all.size() / count]);
  return chosen;
}

bool IsInHull(const Eigen::Vector3d& point, const std::vector<DenseView>& views,
              const std::vector<CoarseMask>& masks, const std::vector<int>& judges) {
  int asked = 0, outside = 0;
  const double most_outside = (1 - kInside) * double(judges.size());
  for (const int judge : judges) {
    const DenseView& view = views[std::size_t(judge)];
    const CoarseMask& mask = masks[std::size_t(judge)];
    const Eigen::Vector3d local = view.cam_from_world * point;
    if (!view.camera.Sees(local)) continue;
    const Eigen::Vector2d pixel = view.camera.Project(local);
    ++asked;
    outside += mask.cells(int(pixel.x()) / mask.factor, int(pixel.y()) / mask.factor) == 0;
    if (outside > most_outside) return false;
  }
  return asked >= 2 && outside <= (1 - kInside) * asked;
}

// Centres of the set cells on a grid of about kRays x kRays over the mask's box, in pixels.
std::vector<Eigen::Vector2d> RaysThrough(const CoarseMask& mask) {
  int left = mask.cells.width(), top = mask.cells.height(), right = -1, bottom = -1;
  for (int y = 0; y < mask.cells.height(); ++y)
    for (int x = 0; x < mask.cells.width(); ++x) {
      if (!mask.cells(x, y)) continue;
      left = std::min(left, x), right = std::max(right, x);
      top = std::min(top, y), bottom = std::max(bottom, y);
    }
  std::vector<Eigen::Vector2d> rays;
  const int step_x = std::max(1, (right - left + kRays) / kRays),
            step_y = std::max(1, (bottom - top + kRays) / kRays);
  for (int y = top; y <= bottom; y += step_y)
    for (int x = left; x <= right; x += step_x)
      if (mask.cells(x, y)) rays.push_back(Eigen::Vector2d(x + 0.5, y + 0.5) * mask.factor);
  return rays;
}

}  // namespace

CoarseMask Coarsen(const Image<std::uint8_t>& mask, int longest_side) {
  const int longest = std::max(mask.width(), mask.height());
  CoarseMask coarse;
  coarse.factor = std::max(1, (longest + longest_side - 1) / longest_side);
  if (mask.empty()) return coarse;
  coarse.cells = {(mask.width() + coarse.factor - 1) / coarse.factor,
                  (mask.height() + coarse.factor - 1) / coarse.factor};
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x)
      if (mask(x, y)) coarse.cells(x / coarse.factor, y / coarse.factor) = 255;
  return coarse;
}

std::optional<DepthRange> RangeFromPoints(const DenseView& view, int index,
                                          const std::vector<ScenePoint>& points) {
  std::vector<double> depths, in_picture;
  for (const ScenePoint& point : points) {
    const Eigen::Vector3d local = view.cam_from_world * point.position;
    if (std::ranges::binary_search(point.views, index)) depths.push_back(local.z());
    if (view.camera.Sees(local)) in_picture.push_back(local.z());
  }
  if (depths.size() < kEnoughPoints) depths = std::move(in_picture);
  if (depths.size() < kEnoughPoints) return {};
  const DepthRange range = Percentiles(depths, 0.01, 0.99);
  return DepthRange{range.min * 0.75, range.max * 1.25};
}

std::optional<DepthRange> RangeFromMasks(const std::vector<DenseView>& views, int index,
                                         const std::vector<CoarseMask>& masks, const DepthRange& limits) {
  const DenseView& view = views[std::size_t(index)];
  const CoarseMask& mask = masks[std::size_t(index)];
  const std::vector<int> judges = Judges(masks, index);
  if (mask.cells.empty() || judges.size() < 2) return {};
  const Rigid world_from_cam = view.cam_from_world.Inverse();
  const double ratio = std::pow(limits.max / limits.min, 1.0 / (kDepths - 1));
  std::vector<double> depths;
  for (const Eigen::Vector2d& pixel : RaysThrough(mask)) {
    const Eigen::Vector3d ray = view.camera.Ray(pixel.x(), pixel.y());
    double depth = limits.min;
    for (int k = 0; k < kDepths; ++k, depth *= ratio)
      if (IsInHull(world_from_cam * Eigen::Vector3d(ray * depth), views, masks, judges))
        depths.push_back(depth);
  }
  if (depths.size() < kEnoughPoints) return {};
  const DepthRange hull = Percentiles(depths, 0.002, 0.998);
  const double margin = kMargin * (hull.max - hull.min) + hull.min * (ratio - 1);
  return DepthRange{std::max(limits.min, hull.min - margin), hull.max + margin};
}

std::vector<DepthRange> EstimateDepthRanges(const std::vector<DenseView>& views,
                                            const std::vector<ScenePoint>& points,
                                            const std::vector<CoarseMask>& masks, Progress& progress) {
  const std::vector<double> focus = FocusDepths(views, points);
  std::vector<DepthRange> ranges(views.size());
  progress.Begin("depth ranges", views.size());
  ParallelFor(0, int(views.size()), [&](int i) {
    progress.Check();
    const double depth = focus[std::size_t(i)];
    auto range = RangeFromMasks(views, i, masks, {depth / 5, depth * 5});
    if (!range) range = RangeFromPoints(views[std::size_t(i)], i, points);
    ranges[std::size_t(i)] = range.value_or(DepthRange{depth / 3, depth * 3});
    progress.Advance();
  });
  return ranges;
}

}  // namespace polarscan
