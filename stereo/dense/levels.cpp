// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/levels.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace polarscan {
namespace {

constexpr double kFewestPixels = 5000;   // of the object in a view of the coarsest level
constexpr double kThinnest = 30;         // px there, mean width of the object's parts
constexpr int kUsual = 3;                // levels; more only where pictures stay large:
constexpr double kLargeSide = 300;       // px, the longer side
constexpr double kUnmaskedWidth = 0.25;  // of the picture's shorter side: that width where no mask tells

// Of the object in pictures, px.
struct Extent {
  double area = 0, outline = 0;
  double Width() const { return 2 * area / std::max(outline, 1e-3); }  // of a long strip: its width
};

// The outline's length from the sides between pixels that it runs along: 4/pi of it, on the mean over all
// directions. The picture's border does not count.
Extent Measure(const Image<std::uint8_t>& mask) {
  std::size_t area = 0, sides = 0;
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x) {
      const bool here = mask(x, y) != 0;
      area += here;
      if (x > 0) sides += here != (mask(x - 1, y) != 0);
      if (y > 0) sides += here != (mask(x, y - 1) != 0);
    }
  return {double(area), double(sides) * std::numbers::pi / 4};
}

Extent WholePicture(const Pinhole& camera) {
  const double area = double(camera.width) * camera.height;
  return {area, 2 * area / (kUnmaskedWidth * std::min(camera.width, camera.height))};
}

// The sum over all views.
Extent MeasureObject(const Workspace& workspace, const StereoOptions& options) {
  Extent sum;
  for (int view = 0; view < int(workspace.views.size()); ++view) {
    const Image<std::uint8_t> mask = options.masks ? ReadViewMask(workspace, view) : Image<std::uint8_t>();
    const Extent extent =
        mask.empty() ? WholePicture(workspace.views[std::size_t(view)].camera) : Measure(mask);
    sum.area += extent.area, sum.outline += extent.outline;
  }
  return sum;
}

}  // namespace

double ObjectPixels(const Workspace& workspace, const StereoOptions& options) {
  return MeasureObject(workspace, options).area;
}

Levels ChooseLevels(const Workspace& workspace, const StereoOptions& options) {
  const Extent extent = MeasureObject(workspace, options);
  const auto pixels = [&](int count) {  // of the coarsest
    return extent.area / double(workspace.views.size()) / std::pow(4, count - 1);
  };
  const auto width = [&](int count) { return extent.Width() / std::pow(2, count - 1); };
  int side = 0;
  for (const DenseView& view : workspace.views)
    side = std::max({side, view.camera.width, view.camera.height});
  const auto large = [&](int count) {
    return count <= kUsual || side / std::pow(2, count - 1) >= kLargeSide;
  };
  Levels levels;
  while (levels.count < options.levels && pixels(levels.count + 1) >= kFewestPixels &&
         width(levels.count + 1) >= kThinnest && large(levels.count + 1))
    ++levels.count;
  levels.match_coarsest = levels.count == 1 && pixels(2) >= kFewestPixels;
  return levels;
}

}  // namespace polarscan
