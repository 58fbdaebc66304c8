// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/progress.h"
#include "stereo/contours/contour_field.h"
#include "stereo/contours/log_distance.h"

namespace polarscan {

// u in pixels, slopes without unit, bends per pixel (log_distance.h). Weights are beside those of the given u.
struct FitOptions {
  float contour = 20;        // of the slope along a contour, which should be 0
  float bend = 5;            // of the surface's second differences, beside a point whose u is 1 off
  float edge_bend = 0.3f;    // a bend that counts half: there may be an edge
  float wrong_slope = 0.3f;  // a slope along a contour that counts a quarter: the label may be wrong
  float outlier_px = 2;      // a given u that is so far away counts a quarter
  float lenience = 16;   // these three begin so much larger; a quarter of it at each re-weighting, down to 1
  int iterations = 100;  // of conjugate gradients, for each
};

// The smooth surface through what seeds and contours say, u of every active pixel: minimises by re-weighted least
// squares
//   sum weight (u - given)^2 + contour sum |field| (slope along the contour)^2 + bend sum |second differences|^2
// with Jacobi-preconditioned conjugate gradients. field: null without polarization. Returns an empty image if nothing
// is given. Throws Cancelled.
Image<float> FitDistances(const Problem& problem, const Distances& given, const ContourField* field,
                          const FitOptions& options, const Progress& progress);

}  // namespace polarscan
