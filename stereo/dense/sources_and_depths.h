// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/progress.h"
#include "stereo/dense/depth_range.h"
#include "stereo/sfm/model/model.h"
#include "stereo/workspace.h"

namespace polarscan {

// Leaves out views that show what one before them shows from the same place (SamePlace): together they know
// no more. Says which. Their depth ranges are not read.
void LeaveOutCopies(const SparseModel& model, Workspace& workspace, Progress& progress);

// Sets the depth ranges of all views from the masks (as many as views, empty where there is none), else from the model's points, else from the poses.
void SetDepthRanges(const SparseModel& model, const std::vector<CoarseMask>& masks, Workspace& workspace,
                    Progress& progress);

// The same from the masks that the workspace has.
void SetDepthRanges(const SparseModel& model, Workspace& workspace, Progress& progress);

// Sets the sources of all views, whose depth ranges are set, from their poses and the model's points. Warns of
// views that no other view goes with, and of those from one place.
void ChooseSources(const SparseModel& model, Workspace& workspace, Progress& progress);

}  // namespace polarscan
