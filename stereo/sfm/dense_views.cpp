// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/dense_views.h"

#include <fmt/format.h>

#include "stereo/sfm/scene.h"
#include "stereo/sfm/source_views.h"

namespace polarscan {

void ChooseSourcesAndDepths(const SparseModel& model, const std::vector<CoarseMask>& masks,
                            Workspace& workspace, Progress& progress) {
  const std::vector<ScenePoint> points = ScenePoints(model, workspace.views);
  const auto sources = ChooseSources(workspace.views, points);
  const auto ranges = EstimateDepthRanges(workspace.views, points, masks, progress);
  for (std::size_t i = 0; i < workspace.views.size(); ++i) {
    DenseView& view = workspace.views[i];
    view.sources = sources[i];
    view.depth_min = ranges[i].min, view.depth_max = ranges[i].max;
    if (view.sources.empty())
      progress.Warn(fmt::format(
          "view {} has no other view to be matched with (all look elsewhere, or from the same place)",
          view.name));
  }
}

}  // namespace polarscan
