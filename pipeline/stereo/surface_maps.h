// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "core/progress.h"
#include "pipeline/stereo/stereo.h"

namespace polarscan {

// EstimateDepths (pipeline/stereo/stereo.h) and its last step, done options.surfaces times: the separate
// maps of all views are fused into a cloud, the cloud becomes one surface that the AoP of all views and the
// masks' outlines refine (pipeline/meshing.h), and each view's map takes its depths and normals from that
// surface (Embree), interpolated between vertices. So each pixel knows what all pixels of all views know; the
// next surface begins with those maps. A pixel keeps its own estimate where the surface has a hole; also, in
// views without masks, where it is a membrane that no points bear out and the two depths differ.
// options.filter: pixels go whose depth the separate maps of too few views support (stereo/rounds/vote.h).
// Maps stay as they were where there is neither polarization nor a mask to refine by; and, with a warning,
// where all views together make no surface (too few points, too large a scene). Goes on where it
// was stopped; same bytes for any number of threads. A shard of several leaves the last step to the program
// that comes after all of them.
void EstimateMaps(const std::filesystem::path& dense, const StereoOptions& options, Progress& progress,
                  const Shard& shard = {});

// What EstimateMaps would do there, and what of it is done.
StereoPlan PlanMaps(const std::filesystem::path& dense, const StereoOptions& options);

}  // namespace polarscan
