// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/image.h"
#include "core/progress.h"
#include "stereo/dense_view.h"

namespace polarscan {

using MaskOf = std::function<Image<std::uint8_t>(int view)>;  // empty: it has none

// Where the masks, between the depths of their views, hold the object to be: along the world's axes.
struct ObjectBox {
  Eigen::Vector3d low, high;
};

struct MasksBox {
  std::vector<int> masked;       // views whose mask holds something
  std::optional<ObjectBox> box;  // what all but a few of them contain; none: nothing
};
// World units a pixel in the middle of the views' depth ranges, median.
double MiddlePixel(const std::vector<DenseView>& views);

MasksBox BoxOfMasks(const std::vector<DenseView>& views, const MaskOf& mask, Progress& progress);

}  // namespace polarscan
