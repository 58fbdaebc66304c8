// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stereo/contours/contour_field.h"
#include "stereo/contours/log_distance.h"

namespace polarscan {

struct TraceOptions {
  float least_field = 0.15f;  // a contour ends where the field is weaker: no polarization, or two directions
  float longest_px = 200;     // a contour ends there, to either side
  float reach_px = 20;        // from so far away a seed counts half
  float disagreement_px = 3;  // of the two ends' u at which they count half
  int seeds = 3;              // on either side, of which the median counts
};

// Propagates distances along contours (Cui et al., CVPR 2017: iso-depth contour tracing). From each pixel with a field
// and without a seed its contour is followed both ways (midpoint steps of one pixel) until it has met some seeds, left
// the object, or lost its direction; the pixel's u is the two ends', by their nearness. Contours lead the same way
// back, so this is what tracing from the seeds would give, with no pixel left out and in no particular order. seeds:
// weight 0 where there is none; they are part of the result as they are.
Distances TraceContours(const Problem& problem, const ContourField& field, const Distances& seeds,
                        const TraceOptions& options);

}  // namespace polarscan
