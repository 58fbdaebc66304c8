// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include <Eigen/Core>

#include "core/progress.h"
#include "stereo/dense/masks/object_box.h"

namespace polarscan {

// A point of the visual hull, world frame; the normal is a unit vector, outward.
struct HullPoint {
  Eigen::Vector3f position, normal;
};

// Where the visual hull of all masks crosses the edges of a grid of kHullCells cells along the longest side of the
// object's box (fewer if they would be smaller than a pixel). What a picture does not show lies outside of the hull if the view's mask keeps clear of the border.
// Needs the views' depth ranges. Empty where masks bound nothing. Throws Cancelled. Same points for any number of threads.
constexpr int kHullCells = 128;
std::vector<HullPoint> HullSurface(const std::vector<DenseView>& views, const MaskOf& mask,
                                   Progress& progress);

}  // namespace polarscan
