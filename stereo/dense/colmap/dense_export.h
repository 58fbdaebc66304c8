// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stereo/sfm/model/model.h"
#include "stereo/workspace.h"

namespace polarscan {

// Writes what COLMAP's dense tools (3.8 to 4.x) and OpenMVS read beside the pictures: sparse/ with PINHOLE
// cameras whose principal point is ours - 0.5 (they take the integer pixel index for the pixel's centre),
// stereo/patch-match.cfg with the sources by name, stereo/fusion.cfg, and the empty folders of the maps.
// `model` is the one that the workspace's views came from (image names NAME.png): its points go along, with
// observations moved to the new pictures.
// COLMAP's tools learn only from shared points which views overlap and how deep the scene is. Where the model
// has next to none (known poses), a grid of points at the ends of each view's depth range, shared with its
// sources, stands for that: black, without error, read by nothing of ours.
void WriteColmapWorkspace(const Workspace& workspace, const SparseModel& model);

// The sparse model that WriteColmapWorkspace writes.
SparseModel ColmapSparse(const Workspace& workspace, const SparseModel& model);

}  // namespace polarscan
