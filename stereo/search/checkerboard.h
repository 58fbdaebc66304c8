// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/progress.h"
#include "stereo/costs/hull_intervals.h"
#include "stereo/costs/problem.h"
#include "stereo/options.h"

namespace polarscan {

// Red-black PatchMatch: the pixels of one colour of a checkerboard are updated from those of the other, so
// all of a colour run in parallel and see stable neighbours. Candidates come from eight zones around the
// pixel (four near, four far; the cheapest pixel of each), as in ACMH (Xu and Tao, CVPR 2019), then the
// hypotheses of eq. (1) and closed-form normals. Sources are not drawn: the best K of S by what they say
// about the nine candidates.
struct CheckerboardPass {
  int iterations = 3;
  bool warm = false;        // start from a map: random depths within 1 %, perturbations from a quarter on
  int first_iteration = 0;  // key of the random numbers
};

// `map`: for a warm pass the estimates to start from (depth 0: none), else empty. On return each active pixel
// has an estimate. Geometric terms count if the sources have maps. Throws Cancelled.
void RunCheckerboard(const Problem& problem, const StereoOptions& options, const Image<DepthInterval>& hull,
                     const CheckerboardPass& pass, DepthNormalMap& map, const Progress& progress);

}  // namespace polarscan
