// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "pipeline/stereo/step_runner.h"
#include "stereo/refined_poses.h"

namespace polarscan {

// From kSeparateMaps of all views to kFinalMaps: options.surfaces times one surface common to all views is
// made of the maps and drawn into each of them (common_surface.h), so that each pixel knows what all pixels
// of all views know; fewer times if the maps hardly change any more. Then (options.filter) pixels go whose
// depth the separate maps of too few views support (stereo/rounds/vote.h).The first
// surfaces refine the poses (options.refine_poses, corrections/pose_refinement.h; refined: what is known by now).
// Returns false where those given are so far off that all maps are to be made again, with the refined ones. Maps stay as they were, with a
// warning, where all views together make no surface. Not for a shard of several. Throws Cancelled.
bool RunSurfaceSteps(StepRunner& steps, RefinedPoses refined);

}  // namespace polarscan
