// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>

#include "stereo/costs/problem.h"

namespace polarscan {

// Where on its ray a pixel may lie: z-depths, near <= far; far = 0: nowhere.
struct DepthInterval {
  float near_depth = 0, far_depth = 0;
};

// For each pixel the part of its ray, within [depth_min, depth_max], from the first to the last point that no
// view's silhouette excludes. Where every point is excluded, or without silhouettes, the whole range.
// `views`: every view with a silhouette, the reference among them or not.
Image<DepthInterval> VisualHull(const Problem& problem, std::span<const Source> views);

// Whether the source's silhouette excludes the point that it sees there. A point outside of the picture is
// excluded only if the silhouette keeps clear of the picture's border.
inline bool OutsideSilhouette(const Source& source, const Seen& seen) {
  if (source.view->silhouette.empty()) return false;
  return seen.inside() ? source.view->silhouette(seen.u, seen.v) == 0 : source.view->whole_silhouette;
}

}  // namespace polarscan
