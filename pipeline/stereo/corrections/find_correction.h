// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>

#include "core/progress.h"
#include "pipeline/stereo/shard.h"
#include "stereo/options.h"
#include "stereo/workspace.h"

namespace polarscan {

// What is wrong with all views' polarization (polarization_fit.h), kept in stereo/polarization.json. as_given:
// the workspace with no correction. inputs: StereoInputHash of it and the options.

// What was found from these inputs; none if it was not looked for.
std::optional<PolarizationCorrection> KnownCorrection(const Workspace& as_given, std::uint64_t inputs);

// The hash for maps that are made with a correction: `inputs` itself without one.
std::uint64_t WithCorrection(std::uint64_t inputs, const PolarizationCorrection& correction);

// Looks for it, if it is not known, with maps of the coarsest size, which stay if nothing is wrong. Shards share
// those out; then the first one looks, and the others wait for it. Throws Cancelled, and Error if a shard waits
// too long.
PolarizationCorrection FindCorrection(const Workspace& as_given, const StereoOptions& options,
                                      std::uint64_t inputs, const Shard& shard, Progress& progress);

}  // namespace polarscan
