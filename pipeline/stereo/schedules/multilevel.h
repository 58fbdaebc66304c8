// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "pipeline/stereo/plan.h"
#include "pipeline/stereo/step_runner.h"

namespace polarscan {

// The schedule of preset "default": coarse to fine, at each level a checkerboard search
// (stereo/search/checkerboard.h) and rounds across views (stereo/rounds/). A step needs the maps of all views
// of the step before, which are kept on disk until it is done. The last step's maps are the result, or
// kSeparateMaps where surfaces follow. Throws Cancelled.
void RunMultilevel(StepRunner& steps);

// The first search and the rounds after it (options.rounds, one at least). Of what kind their maps are, and how
// often their pictures are halved. Throws Cancelled.
struct CoarseMaps {
  MapKind kind;
  int halvings = 0;
};
CoarseMaps RunCoarsest(StepRunner& steps);

// The steps of that schedule, none of them marked as done.
std::vector<StereoStep> MultilevelSteps(const Workspace& workspace, const StereoOptions& options);

}  // namespace polarscan
