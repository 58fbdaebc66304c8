// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "core/progress.h"
#include "stereo/sfm/scene_points.h"

namespace polarscan {

struct DepthRange {
  double min = 0, max = 0;  // z in the camera frame, world units, > 0
};

// A mask at a coarse scale: a cell is set where any of its factor x factor pixels is.
struct CoarseMask {
  Image<std::uint8_t> cells;  // empty: the view has no mask
  int factor = 1;
};
CoarseMask Coarsen(const Image<std::uint8_t>& mask, int longest_side = 400);

// As COLMAP: 1st and 99th percentile of the view's points, times 0.75 and 1.25; where these are few, of those that lie in
// its picture. None with few points.
std::optional<DepthRange> RangeFromPoints(const DenseView& view, int index,
                                          const std::vector<ScenePoint>& points);

// Extent of the masks' visual hull as the view sees it: rays through its mask, sampled between the limits; a
// sample is inside if it falls into the masks of nine tenths of the other views whose picture contains it.
// Ends are percentiles with a margin, so a few bad masks do little. None if there are fewer than two other
// masks, or the hull is empty.
std::optional<DepthRange> RangeFromMasks(const std::vector<DenseView>& views, int index,
                                         const std::vector<CoarseMask>& masks, const DepthRange& limits);

// A range for each view: from the masks where there are some (only pixels inside are estimated), else from
// the points, else a third to three times the depth that the view looks at.
std::vector<DepthRange> EstimateDepthRanges(const std::vector<DenseView>& views,
                                            const std::vector<ScenePoint>& points,
                                            const std::vector<CoarseMask>& masks, Progress& progress);

}  // namespace polarscan
