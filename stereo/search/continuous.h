// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/progress.h"
#include "stereo/costs/problem.h"
#include "stereo/options.h"

namespace polarscan {

// Lowers eq. (2) of every active pixel over its depth and its normal's two angles, which PatchMatch only tries at
// random: Levenberg-Marquardt (ceres::TinySolver) on the terms' square roots, derivatives by differences,
// options.continuous_iterations steps at most. Each pixel by itself: its neighbours, for F_dep, are those of
// `map` as it comes in. An estimate changes only if its cost falls. Sources count by their probability to see
// the pixel: `selection`, one value a pixel and source, source fastest. Throws Cancelled.
void RefineContinuously(const Problem& problem, const StereoOptions& options,
                        const std::vector<float>& selection, DepthNormalMap& map, const Progress& progress);

}  // namespace polarscan
