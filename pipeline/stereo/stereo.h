// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "core/progress.h"
#include "pipeline/stereo/plan.h"
#include "pipeline/stereo/shard.h"
#include "stereo/options.h"
#include "stereo/workspace.h"

namespace polarscan {

// The stage `stereo`: PolarPMS over a dense workspace (stereo/workspace.h). Writes
// stereo/depth_maps/NAME.png.{photometric,geometric}.bin and stereo/normal_maps/... A view's maps are kept if
// they were made with the same inputs and options (stereo/done.json holds the hashes), so a killed run goes
// on where it was. Same bytes for any number of threads, and of shards: each makes its views and waits for
// the others' between steps; the steps of the common surface are left to the program that comes after all of
// them. Throws Error if the workspace is damaged or a view has no source views, Cancelled.
void EstimateMaps(const std::filesystem::path& dense, const StereoOptions& options, Progress& progress,
                  const Shard& shard = {});

// What EstimateMaps would do there, and what of it is done. Throws Error if the workspace is damaged.
StereoPlan PlanMaps(const std::filesystem::path& dense, const StereoOptions& options);

// Of the options and of all files that the maps depend on.
std::uint64_t StereoInputHash(const Workspace& workspace, const StereoOptions& options);

}  // namespace polarscan
