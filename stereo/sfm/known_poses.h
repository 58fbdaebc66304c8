// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "stereo/sfm/model.h"
#include "stereo/sfm/view_list.h"

namespace polarscan {

// The part of a given model that belongs to the views: an image cam1/0.jpg is the view cam1-0, or 0 if no
// other image ends like that; extensions do not count. They are renamed NAME.png; cameras are scaled to the
// views' size; points that no view sees are dropped. `where` names the model in messages. Throws Error, with
// examples of both names, if nothing matches; or if a view's name fits two images.
SparseModel SelectKnownPoses(const SparseModel& given, const std::vector<View>& views,
                             const std::string& where);

}  // namespace polarscan
