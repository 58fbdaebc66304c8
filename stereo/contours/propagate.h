// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/progress.h"
#include "stereo/contours/fit_distances.h"
#include "stereo/contours/labels.h"
#include "stereo/contours/trace.h"

namespace polarscan {

// Polarimetric MVS (Cui, Gu, Shi, Tan, Kautz, CVPR 2017), a rival of the paper: of one view, what follows from its
// reliable points and its polarization; no other view is looked at.
struct PropagationOptions {
  int turns = 2;          // after the first, labels come from the surface of the turn before
  float contours = 0.4f;  // what a depth that came along a contour counts beside a reliable one
  LabelOptions labels;
  TraceOptions trace;
  FitOptions fit;
};

// Depth and normal of every active pixel, and which pixels are reliable points or met one along their contour (255).
// Depths 0 if there are no reliable points.
struct Propagated {
  DepthNormalMap map;
  Image<std::uint8_t> reached;
};

// Labels, contours and a surface in turns, then normals: the depth map's, turned to the azimuth. reliable: depth 0
// where unknown; its normals, also there, tell the first labels. Without polarization a surface only. Throws Cancelled.
Propagated PropagateDepth(const Problem& problem, const DepthNormalMap& reliable,
                          const PropagationOptions& options, const Progress& progress);

}  // namespace polarscan
