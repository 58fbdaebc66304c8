// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/crop.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "stereo/dense/levels.h"

namespace polarscan {
namespace {

// Pixels from left to right and top to bottom, the last ones not included.
struct Box {
  int left, top, right, bottom;
};

std::optional<Box> BoxOf(const Image<std::uint8_t>& mask) {
  Box box{mask.width(), mask.height(), 0, 0};
  for (int y = 0; y < mask.height(); ++y) {
    const auto* begin = mask.row(y);
    const auto* end = begin + mask.width();
    const auto* first = std::find_if(begin, end, [](std::uint8_t m) { return m != 0; });
    if (first == end) continue;
    const auto* last = end;
    while (!last[-1]) --last;
    box.left = std::min(box.left, int(first - begin)), box.right = std::max(box.right, int(last - begin));
    box.top = std::min(box.top, y), box.bottom = y + 1;
  }
  if (box.right == 0) return {};
  return box;
}

// step: so that pixels of every smaller size cover the same ones of the picture, and of the same colour of
// the checkerboard.
void Cut(DenseView& view, const Box& box, int margin, int step) {
  Pinhole& camera = view.camera;
  if (box.left < margin || box.top < margin || box.right > camera.width - margin ||
      box.bottom > camera.height - margin)
    return;
  const auto down = [&](int x) { return x / step * step; };
  const int left = down(box.left - margin), top = down(box.top - margin);
  const int right = std::min(camera.width, down(box.right + margin + step - 1));
  const int bottom = std::min(camera.height, down(box.bottom + margin + step - 1));
  view.window = PictureWindow{left, top, camera.width, camera.height};
  camera = {right - left, bottom - top, camera.fx, camera.fy, camera.cx - left, camera.cy - top};
}

}  // namespace

Workspace CutToObject(const Workspace& workspace, const StereoOptions& options) {
  if (!options.masks || options.schedule != "checkerboard") return workspace;
  Workspace cut = workspace;
  const int halvings = ChooseLevels(workspace, options).count - 1;
  const int windows = options.window_radius + int(std::ceil(options.silhouette_margin_px)) + 1;
  const int margin = windows << halvings, step = 2 << halvings;
  ParallelFor(0, int(cut.views.size()), [&](int view) {
    const Image<std::uint8_t> mask = ReadViewMask(workspace, view);
    if (const std::optional<Box> box = BoxOf(mask)) Cut(cut.views[std::size_t(view)], *box, margin, step);
  });
  return cut;
}

}  // namespace polarscan
