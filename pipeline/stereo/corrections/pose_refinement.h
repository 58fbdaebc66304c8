// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "core/mesh.h"
#include "core/progress.h"
#include "stereo/options.h"
#include "stereo/refined_poses.h"

namespace polarscan {

// Poses that fit the surface of all views (fusion/surface/refinement/pose_fit.h): all of them, if the views move by
// more than such a fit is uncertain by, in the median; else those of single views that are far off. None that is better,
// none at all, where most views cannot be fitted. Kept in stereo/poses.json, with `inputs`.
RefinedPoses RefinePoses(const TriangleMesh& surface, const Workspace& as_given, const StereoOptions& options,
                         const std::string& inputs, Progress& progress);

// "the poses were refined ..."; empty for none.
std::string RefinedPosesWords(const RefinedPoses& refined);

}  // namespace polarscan
