// SPDX-License-Identifier: Apache-2.0
#include "pipeline/workspace_views.h"

#include <filesystem>

namespace polarscan {

SurfaceViews ViewsOfWorkspace(const Workspace& workspace) {
  SurfaceViews views{workspace.views, workspace.polarized, false, {}, {}};
  for (int view = 0; view < int(workspace.views.size()); ++view)
    views.masked = views.masked || std::filesystem::exists(workspace.MaskPath(view));
  views.light = [&workspace](int view) { return ReadViewLight(workspace, view); };
  views.mask = [&workspace](int view) { return ReadViewMask(workspace, view); };
  return views;
}

}  // namespace polarscan
