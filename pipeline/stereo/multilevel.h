// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "core/progress.h"
#include "pipeline/stereo/plan.h"
#include "pipeline/stereo/shard.h"
#include "stereo/options.h"
#include "stereo/workspace.h"

namespace polarscan {

// The schedule of preset "default": coarse to fine, at each level a checkerboard search (checkerboard.h) and
// rounds across views (stereo/rounds/). Every step is a barrier: it needs the maps of all views of the step
// before, which are kept on disk beside the final ones until the next step is done. The last step's maps are
// the "geometric" ones. input_hash: of everything that the maps depend on. Throws Cancelled.
void RunMultilevel(const Workspace& workspace, const StereoOptions& options, std::uint64_t input_hash,
                   const Shard& shard, Progress& progress);

// The steps of that schedule, none of them marked as done.
std::vector<StereoStep> MultilevelSteps(const Workspace& workspace, const StereoOptions& options);

}  // namespace polarscan
