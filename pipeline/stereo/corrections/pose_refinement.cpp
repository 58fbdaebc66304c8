// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/corrections/pose_refinement.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "core/files/files.h"
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

RefinedPoses KnownPoses(const Workspace& workspace, const std::string& inputs) {
  const auto found = ReadRefinedPoses(workspace.folder);
  RefinedPoses none;
  none.inputs = inputs;
  return found && found->inputs == inputs ? *found : none;
}

std::uint64_t WithStart(std::uint64_t inputs, const RefinedPoses& refined) {
  for (const auto& [name, pose] : refined.start) {
    inputs = Hash(name, inputs);
    for (int i = 0; i < 9; ++i) inputs = Hash(fmt::format("{}", pose.rotation(i / 3, i % 3)), inputs);
    for (int i = 0; i < 3; ++i) inputs = Hash(fmt::format("{}", pose.translation[i]), inputs);
  }
  return inputs;
}

void AddPoseFit(const TriangleMesh& surface, const Workspace& posed, const StereoOptions& options,
                double least_px, RefinedPoses& refined, Progress& progress) {
  const std::vector<PoseFit> fits = FitPoses(surface, ViewsOfWorkspace(posed), options.masks, progress);
  const bool again = refined.Any();
  std::vector<double> moves;
  for (const PoseFit& fit : fits)
    if (fit.fitted) moves.push_back(fit.moved_px);
  const double median = Median(moves), far = std::max(kFarPx, kTimesMedian * median);
  PosesByName poses;
  for (std::size_t i = 0; i < fits.size() && 2 * moves.size() >= fits.size(); ++i) {
    if (!fits[i].fitted || fits[i].moved_px < least_px ||
        (!again && median < kClearPx && fits[i].moved_px < far))
      continue;
    const std::string& name = posed.views[i].name;
    poses[name] = fits[i].cam_from_world;
    if (!again && fits[i].moved_px > refined.worst_px)
      refined.worst_px = fits[i].moved_px, refined.worst = name;
  }
  if (!again) refined.median_px = median;
  refined.fits.push_back(std::move(poses));
  progress.Info(fmt::format("fit of the poses: {} of {} views, by {:.2f} px in the median", moves.size(),
                            fits.size(), median));
}

bool BeginsAnew(const Workspace& workspace, RefinedPoses& refined) {
  if (!refined.start.empty() || refined.fits.size() != 1 || refined.worst_px < kUselessPx) return false;
  refined.start = std::move(refined.fits[0]);
  refined.fits.clear();
  WriteRefinedPoses(workspace.folder, refined);
  return true;
}

std::string RefinedPosesWords(const RefinedPoses& refined) {
  if (!refined.Any()) return "";
  if (refined.median_px >= kClearPx)
    return fmt::format(
        "the poses were refined by the surface: it lay {:.1f} px off in the pictures in the median, {:.1f} "
        "px in "
        "that of {}",
        refined.median_px, refined.worst_px, refined.worst);
  std::vector<std::string> names;
  for (const auto& [name, pose] : refined.start.empty() ? refined.fits[0] : refined.start)
    names.push_back(name);
  return fmt::format(
      "the pose{} of {} did not fit the surface that the others agree on, by up to {:.1f} px, and {} refined",
      names.size() == 1 ? "" : "s", Enumerate(names), refined.worst_px, names.size() == 1 ? "was" : "were");
}

}  // namespace polarscan
