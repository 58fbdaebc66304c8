// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stereo/sfm/check_poses.h"
#include "stereo/sfm/colmap/mapping.h"

namespace polarscan {

// Cameras and poses by the pictures' features, in COLMAP. Tries what costs little first: as asked; then all pairs, if
// only neighbours were matched; then lower thresholds; then small parts too; then only what is inside of masks; then
// other focal lengths. The best model (may be empty), and what is known of those that it lacks.
SparseModel PosesByFeatures(const Mapping& mapping, Evidence& evidence);

}  // namespace polarscan
