// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stereo/options.h"
#include "stereo/workspace.h"

namespace polarscan {

// The workspace with each view cut to the rectangle of its mask and a margin that no window or silhouette of
// the coarsest size leaves, so that the background costs nothing. Views without a mask, with an empty one, or
// whose object comes so near to the picture's border that the picture may not show all of it stay whole.
Workspace CutToObject(const Workspace& workspace, const StereoOptions& options);

}  // namespace polarscan
