// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "pipeline/stereo/step_runner.h"

namespace polarscan {

// From kSeparateMaps of all views to kFinalMaps: options.surfaces times one surface common to all views is
// made of the maps and drawn into each of them (common_surface.h), so that each pixel knows what all pixels
// of all views know; fewer times if the maps hardly change any more. Then (options.filter) pixels go whose
// depth the separate maps of too few views support (stereo/rounds/vote.h). The first surface refines the poses, once
// (options.refine_poses, corrections/pose_refinement.h; inputs: a hash of what the separate maps are made from). Maps stay as they were, with a
// warning, where all views together make no surface. Not for a shard of several. Throws Cancelled.
void RunSurfaceSteps(StepRunner& steps, const std::string& inputs);

}  // namespace polarscan
