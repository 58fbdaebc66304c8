// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/progress.h"
#include "stereo/costs/hull_intervals.h"
#include "stereo/costs/problem.h"
#include "stereo/options.h"

namespace polarscan {

// What the sweeps of one reference view improve. costs and selection: one value a pixel and source, source
// fastest: the matching cost 1 - NCC of the current estimate, and the probability that the source sees it.
struct MatchState {
  DepthNormalMap map;
  std::vector<float> costs, selection;
};

// One pass over all pixels: along lines of direction (dx, dy), one of the four axis directions.
struct Sweep {
  int dx = 1, dy = 0;
  float perturbation = 1;      // 1 halving every iteration
  float selection_memory = 0;  // share of the last sweep's selection probability that is kept
  float random_depth = 0;      // random depths: within this share of the current one; 0: anywhere in the hull
  int index = 0;               // key of the random numbers; grows over both passes
};

// Depths drawn at random in the hull, or those of `start` where it has one; random or, if asked for,
// closed-form normals.
MatchState InitialState(const Problem& problem, const StereoOptions& options,
                        const Image<DepthInterval>& hull, const DepthNormalMap* start);

// The seven hypotheses of eq. (1), and the closed-form ones if asked for, tried at every active pixel; eq.
// (2) decides. Lines run in parallel and read nothing that another line writes: what they need of
// neighbouring lines is taken from a copy made before the sweep. So the result does not depend on the number
// of threads. Geometric terms count if the sources have maps. Throws Cancelled.
void RunSweep(const Problem& problem, const StereoOptions& options, const Image<DepthInterval>& hull,
              const Sweep& sweep, MatchState& state, const Progress& progress);

}  // namespace polarscan
