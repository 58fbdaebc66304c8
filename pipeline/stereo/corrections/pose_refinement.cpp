// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/corrections/pose_refinement.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "core/statistics.h"
#include "core/words.h"
#include "fusion/surface/refinement/pose_fit.h"
#include "pipeline/workspace_views.h"

namespace polarscan {
namespace {

constexpr double kClearPx =
    0.35;  // median move: below, poses are as good as the surface that would mend them
constexpr double kFarPx = 1, kTimesMedian = 4;  // of a single view

}  // namespace

RefinedPoses RefinePoses(const TriangleMesh& surface, const Workspace& as_given, const StereoOptions& options,
                         const std::string& inputs, Progress& progress) {
  RefinedPoses refined;
  refined.inputs = inputs;
  const std::vector<PoseFit> fits = FitPoses(surface, ViewsOfWorkspace(as_given), options.masks, progress);
  std::vector<double> moves;
  for (const PoseFit& fit : fits)
    if (fit.fitted) moves.push_back(fit.moved_px);
  if (2 * moves.size() >= fits.size()) {
    const double median = Median(moves), far = std::max(kFarPx, kTimesMedian * median);
    for (std::size_t i = 0; i < fits.size(); ++i) {
      if (!fits[i].fitted || (median < kClearPx && fits[i].moved_px < far)) continue;
      const std::string& name = as_given.views[i].name;
      refined.cam_from_world[name] = fits[i].cam_from_world;
      if (fits[i].moved_px > refined.worst_px) refined.worst_px = fits[i].moved_px, refined.worst = name;
    }
    refined.median_px = median;
  }
  progress.Info(fmt::format("fit of the poses: {} of {} views, {:.2f} px in the median", moves.size(),
                            fits.size(), Median(moves)));
  WriteRefinedPoses(as_given.folder, refined);
  return refined;
}

std::string RefinedPosesWords(const RefinedPoses& refined) {
  if (refined.cam_from_world.empty()) return "";
  if (refined.median_px >= kClearPx)
    return fmt::format(
        "the poses were refined by the surface: it lay {:.1f} px off in the pictures in the median, {:.1f} "
        "px in "
        "that of {} (--no-refine-poses takes them as they are)",
        refined.median_px, refined.worst_px, refined.worst);
  std::vector<std::string> names;
  for (const auto& [name, pose] : refined.cam_from_world) names.push_back(name);
  return fmt::format(
      "the pose{} of {} did not fit the surface that the others agree on, by up to {:.1f} px, and {} refined "
      "(--no-refine-poses takes poses as they are)",
      names.size() == 1 ? "" : "s", Enumerate(names), refined.worst_px, names.size() == 1 ? "was" : "were");
}

}  // namespace polarscan
