// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "core/progress.h"
#include "pipeline/stereo/plan.h"
#include "pipeline/stereo/shard.h"
#include "stereo/options.h"
#include "stereo/workspace.h"

namespace polarscan {

// PolarPMS over a dense workspace (stereo/workspace.h): a photometric pass over all views (F_pho +
// F_pol + F_dep), then a geometric pass over all views that starts from those maps, adds F_geo and filters;
// or the schedule of multilevel.h. Writes stereo/depth_maps/NAME.png.{photometric,geometric}.bin and
// stereo/normal_maps/...; with options.surfaces the last maps are kSeparateMaps, without a filter, for
// pipeline/stereo/surface_maps.h.
// A view's maps are kept if they were made with the same inputs and options (stereo/done.json holds the
// hashes), so a killed run goes on where it was. Throws Error if the workspace is damaged or a view has no
// source views.
// Shards make the same bytes as one program: each makes its views and waits for the others' between passes.
void EstimateDepths(const std::filesystem::path& dense, const StereoOptions& options, Progress& progress,
                    const Shard& shard = {});

// The same for one who has read the workspace and hashed its inputs.
void EstimateDepths(const Workspace& workspace, const StereoOptions& options, std::uint64_t input_hash,
                    Progress& progress, const Shard& shard = {});

// Of the options and of all files that the maps depend on.
std::uint64_t StereoInputHash(const Workspace& workspace, StereoOptions options);

// What EstimateDepths and the surface would do, and how much of it is done. Throws Error if the workspace is
// damaged.
StereoPlan PlanDepths(const std::filesystem::path& dense, const StereoOptions& options);

}  // namespace polarscan
