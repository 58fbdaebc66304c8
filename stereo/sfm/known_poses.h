// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "stereo/sfm/model.h"
#include "stereo/sfm/view_list.h"

namespace polarscan {

// The part of a given model that belongs to the views: images are matched by stem (folders and extensions do
// not count) and renamed NAME.png; cameras are scaled to the views' size; points that no view sees are
// dropped. `where` names the model in messages. Throws Error, with examples of both names, if nothing
// matches; or if two images have one stem.
SparseModel SelectKnownPoses(const SparseModel& given, const std::vector<View>& views,
                             const std::string& where);

}  // namespace polarscan
