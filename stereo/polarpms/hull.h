// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>

#include "stereo/polarpms/problem.h"

namespace polarscan {

// Where on its ray a pixel may lie: z-depths, near <= far; far = 0: nowhere.
struct DepthInterval {
  float near_depth = 0, far_depth = 0;
};

// For each pixel the first interval of its ray, within [depth_min, depth_max], that no view's silhouette
// excludes (a point outside of a view's picture is not excluded by it). Where there is no such interval, or
// no silhouettes, the whole range. `views`: every view with a silhouette, the reference among them or not.
Image<DepthInterval> VisualHull(const Problem& problem, std::span<const Source> views);

// Whether the source's silhouette excludes the point that it sees there.
inline bool OutsideSilhouette(const Source& source, const Seen& seen) {
  return seen.inside() && !source.view->silhouette.empty() && source.view->silhouette(seen.u, seen.v) == 0;
}

}  // namespace polarscan
