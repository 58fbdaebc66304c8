// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "stereo/sfm/model/model.h"

namespace polarscan {

// For poses that were written by another convention: if the cameras do not look at a common place as the
// poses are read, but would all do so read another way (quaternion x y z w, camera to world, y up and z
// backward), says that in words; else empty. So it is for fewer than three poses, for parallel lines of
// sight, and for models with points, which bear the poses out.
std::string OtherConvention(const SparseModel& model);

}  // namespace polarscan
