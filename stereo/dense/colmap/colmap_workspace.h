// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "core/progress.h"

namespace polarscan {

// Whether the folder looks like a dense workspace of COLMAP (image_undistorter): images/ and sparse/, and no
// Stokes views.
bool IsColmapWorkspace(const std::filesystem::path& folder);

// Makes COLMAP's dense workspace one of ours (stereo/workspace.h) by writing views.json: cameras and
// poses from sparse/ (in a local frame where they lie far from 0), copies left out (dense_views.h), sources
// and depth ranges as Undistort chooses them, the pictures as plain photos; masks/NAME.png count if they are
// there. Everything else in the folder stays as it is. Throws Error if the model is damaged, has cameras with
// distortion, or names a picture that is not there.
void AdoptColmapWorkspace(const std::filesystem::path& folder, Progress& progress);

}  // namespace polarscan
