// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "fusion/surface/surface_views.h"
#include "stereo/workspace.h"

namespace polarscan {

// The views of a workspace, which must last as long; its files are read when they are asked for.
SurfaceViews ViewsOfWorkspace(const Workspace& workspace);

}  // namespace polarscan
