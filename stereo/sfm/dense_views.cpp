// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/dense_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "stereo/sfm/scene.h"
#include "stereo/sfm/source_views.h"
#include "stereo/sfm/view_list.h"

namespace polarscan {
namespace {

// Names the views of each place that more than one was taken from.
void WarnOfRepeatedPlaces(const std::vector<DenseView>& views, Progress& progress) {
  const std::vector<int> places = Places(views);
  std::map<int, std::vector<std::string>> names;
  for (std::size_t i = 0; i < views.size(); ++i) names[places[i]].push_back(views[i].name);
  std::vector<std::string> repeated;
  for (const auto& [place, here] : names) {
    if (here.size() == 2) repeated.push_back(here[0] + " and " + here[1]);
    if (here.size() > 2) repeated.push_back(Enumerate(here, 3));
  }
  if (repeated.empty()) return;
  std::string list;
  for (std::size_t i = 0; i < std::min<std::size_t>(repeated.size(), 8); ++i)
    list += (list.empty() ? "" : "; ") + repeated[i];
  if (repeated.size() > 8) list += fmt::format("; and {} more places", repeated.size() - 8);
  progress.Warn(fmt::format(
      "pictures were taken from the same place: {}. Those of one place count as one view; take them farther "
      "apart (about 20 degrees), or leave the copies out",
      list));
}

}  // namespace

void ChooseSourcesAndDepths(const SparseModel& model, const std::vector<CoarseMask>& masks,
                            Workspace& workspace, Progress& progress) {
  const std::vector<ScenePoint> points = ScenePoints(model, workspace.views);
  const auto ranges = EstimateDepthRanges(workspace.views, points, masks, progress);
  for (std::size_t i = 0; i < ranges.size(); ++i)
    workspace.views[i].depth_min = ranges[i].min, workspace.views[i].depth_max = ranges[i].max;
  const auto sources = ChooseSources(workspace.views, points);
  WarnOfRepeatedPlaces(workspace.views, progress);
  for (std::size_t i = 0; i < workspace.views.size(); ++i) {
    DenseView& view = workspace.views[i];
    view.sources = sources[i];
    if (view.sources.empty())
      progress.Warn(fmt::format(
          "view {} has no other view to be matched with (all look elsewhere, or from the same place)",
          view.name));
  }
}

}  // namespace polarscan
