// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/progress.h"
#include "stereo/sfm/depth_range.h"
#include "stereo/sfm/model.h"
#include "stereo/workspace.h"

namespace polarscan {

// Sets the sources and depth ranges of all views from their poses, the model's points and the masks (as many
// as views, empty where there is none). Warns of views that no other view goes with, and of
// those from one place.
void ChooseSourcesAndDepths(const SparseModel& model, const std::vector<CoarseMask>& masks,
                            Workspace& workspace, Progress& progress);

}  // namespace polarscan
