// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/progress.h"
#include "stereo/workspace.h"

namespace polarscan {

// Views (by place) whose pictures show the same background at the same place, as where an object turned before a camera
// that stood still: groups of eight or more, each of one camera. Two views belong together if fine texture is alike, pixel
// by pixel, along the picture's border: in half of those of its 28 tiles (of a picture of at most 160 px) that have texture
// in both, normalized correlation is .8 or more. A plain background has none. Looks at few views first: usually there are no groups.
std::vector<std::vector<int>> GroupsBeforeOneBackground(const Workspace& workspace, Progress& progress);

}  // namespace polarscan
