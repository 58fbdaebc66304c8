// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <string>

#include "core/mesh.h"
#include "core/progress.h"
#include "stereo/options.h"
#include "stereo/refined_poses.h"

namespace polarscan {

// Those of stereo/poses.json if they were found from the same inputs, else none.
RefinedPoses KnownPoses(const Workspace& workspace, const std::string& inputs);

// `inputs` with the poses that stereo began anew with.
std::uint64_t WithStart(std::uint64_t inputs, const RefinedPoses& refined);

constexpr double kUselessPx = 3;  // a view that is off by so much tells the others nothing that is right

// Adds a fit of the poses to a surface (fusion/surface/refinement/pose_fit.h), which may be empty. The first fit takes all
// views, if they move by more than such a fit is uncertain by, in the median; else single ones that are far off; none,
// where most views cannot be fitted. Fits after one that is not empty take all. Only views that move by least_px or more.
// posed: the views with the poses of all fits before.
void AddPoseFit(const TriangleMesh& surface, const Workspace& posed, const StereoOptions& options,
                double least_px, RefinedPoses& refined, Progress& progress);

// Whether the first fit moved a view so far that its maps, and what it said to others, are worth nothing: then it is
// made the start (and written), from which all maps are to be made again. Once only.
bool BeginsAnew(const Workspace& workspace, RefinedPoses& refined);

// "the poses were refined ..."; empty for none.
std::string RefinedPosesWords(const RefinedPoses& refined);

}  // namespace polarscan
