// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/sources_and_depths.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/words.h"
#include "stereo/dense/source_views.h"
#include "stereo/sfm/scene_points.h"
#include "stereo/sfm/view_list.h"

namespace polarscan {
namespace {

// "a and b; c, d and e": the names of each group, by its first one.
std::string InWords(const std::map<int, std::vector<std::string>>& groups) {
  constexpr std::size_t kMost = 8;
  std::string text;
  for (std::size_t shown = 0; const auto& [first, names] : groups) {
    if (++shown > kMost) break;
    text += text.empty() ? "" : "; ";
    text += names.size() == 2 ? names[0] + " and " + names[1] : Enumerate(names, 3);
  }
  return groups.size() > kMost ? fmt::format("{}; and {} more places", text, groups.size() - kMost) : text;
}

// Whether `view` shows next to nothing that `first`, from the same place, does not.
bool ShowsTheSame(const DenseView& view, const DenseView& first) {
  constexpr int kSide = 5;  // rays a side of its picture, which end in the middle of its depths
  for (int i = 0; i < kSide * kSide; ++i) {
    const double u = (i % kSide + 0.5) * view.camera.width / kSide,
                 v = (i / kSide + 0.5) * view.camera.height / kSide;
    const Eigen::Vector3d point =
        view.cam_from_world.Inverse() * Eigen::Vector3d(view.depth_min * view.camera.Ray(u, v));
    if (!first.camera.Sees(first.cam_from_world * point)) return false;
  }
  return true;
}

// Of views that show different things from one place.
void WarnOfRepeatedPlaces(const std::vector<DenseView>& views, Progress& progress) {
  const std::vector<int> places = Places(views);
  std::map<int, std::vector<std::string>> groups;
  for (std::size_t i = 0; i < views.size(); ++i) groups[places[i]].push_back(views[i].name);
  std::erase_if(groups, [](const auto& group) { return group.second.size() < 2; });
  if (!groups.empty())
    progress.Warn(fmt::format(
        "pictures were taken from the same place: {}. Those of one place count as one witness; move the "
        "camera, or the object, between pictures",
        InWords(groups)));
}

}  // namespace

void LeaveOutCopies(const SparseModel& model, Workspace& workspace, Progress& progress) {
  std::vector<DenseView> all = workspace.views;
  const std::vector<double> focus = FocusDepths(all, ScenePoints(model, all));
  for (std::size_t i = 0; i < all.size(); ++i) all[i].depth_min = all[i].depth_max = focus[i];
  std::vector<int> kept;
  std::map<int, std::vector<std::string>> groups;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto first = std::ranges::find_if(kept, [&](int k) {
      const DenseView& before = all[std::size_t(k)];
      return SamePlace(all[i], before) && ShowsTheSame(all[i], before);
    });
    if (first == kept.end()) {
      kept.push_back(int(i));
      continue;
    }
    std::vector<std::string>& names = groups[*first];
    if (names.empty()) names.push_back(all[std::size_t(*first)].name);
    names.push_back(all[i].name);
  }
  if (groups.empty() || kept.size() < 2) return;
  std::vector<DenseView> views;
  for (const int k : kept) views.push_back(workspace.views[std::size_t(k)]);
  workspace.views = std::move(views);
  progress.Warn(fmt::format(
      "pictures were taken from the same place: {}. They count as one: only the first is used ({} of {} "
      "views are left)",
      InWords(groups), kept.size(), all.size()));
}

void SetDepthRanges(const SparseModel& model, const std::vector<CoarseMask>& masks, Workspace& workspace,
                    Progress& progress) {
  const auto ranges =
      EstimateDepthRanges(workspace.views, ScenePoints(model, workspace.views), masks, progress);
  for (std::size_t i = 0; i < ranges.size(); ++i)
    workspace.views[i].depth_min = ranges[i].min, workspace.views[i].depth_max = ranges[i].max;
}

void SetDepthRanges(const SparseModel& model, Workspace& workspace, Progress& progress) {
  std::vector<CoarseMask> masks;
  for (int i = 0; i < int(workspace.views.size()); ++i) masks.push_back(Coarsen(ReadViewMask(workspace, i)));
  SetDepthRanges(model, masks, workspace, progress);
}

void ChooseSources(const SparseModel& model, Workspace& workspace, Progress& progress) {
  const auto sources = ChooseSourceViews(workspace.views, ScenePoints(model, workspace.views));
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
