// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/image.h"
#include "stereo/costs/problem.h"

namespace polarscan {

struct SurfaceMatchingOptions {
  int chosen_sources = 3;  // at a pixel, those that match best
  float epsilon = 1e-5f;   // added to each variance
  int steps = 3;           // tried in front of the surface, and as many behind it
  float step_px = 0.5f;    // of a step, the median motion of the sources' pixels
  float window_px = 1.5f;  // standard deviation of the window's Gaussian weights
  float smoothing_px = 5;  // of the moves found
};

// Photometric refinement of a whole depth map: the sources' pictures are drawn onto the surface, moved
// towards and away from the camera in small steps (one relative depth for all pixels), and each pixel moves
// to the step where its window looks most alike (1 - NCC, Gaussian weights, the mean of the sources that
// match best, sub-step by a parabola). The windows follow the surface, so a curved one does not pull its
// depth as the planes of PatchMatch do: matched around the truth, these moved it by half as much in our
// measurements (docs/notes/matching.md). A pixel's move is the mean over its surroundings on the same surface,
// weighted by how sharp each minimum is; where nothing can be told the depth stays. Normals stay. Sources
// that carry maps do not count where their own surface hides the point.
Image<float> MatchSurface(const Problem& problem, const DepthNormalMap& own,
                          const SurfaceMatchingOptions& options);

}  // namespace polarscan
