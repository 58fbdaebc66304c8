// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/stereo.h"

#include <algorithm>
#include <set>

#include "core/files/files.h"
#include "pipeline/stereo/common_surface.h"
#include "pipeline/stereo/corrections/find_correction.h"
#include "pipeline/stereo/corrections/pose_refinement.h"
#include "pipeline/stereo/schedules/acmmp.h"
#include "pipeline/stereo/schedules/multilevel.h"
#include "pipeline/stereo/schedules/polarimetric_mvs.h"
#include "pipeline/stereo/schedules/sequential.h"
#include "pipeline/stereo/stage_inputs.h"
#include "pipeline/stereo/surface_steps.h"

#include "pipeline/workspace_views.h"
#include "stereo/dense/crop.h"
#include "stereo/dense/levels.h"
#include "stereo/dense/load_view.h"
#include "stereo/refined_poses.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr double kSupportOfTwo = 1.2;  // a view gives 1 at most: more than one alone, though both look askew
constexpr double kFarApart = 40;       // degrees between neighbours: hardly a place is seen by three views

// Without polarization where it is nothing but noise, without surfaces where nothing could refine one, and
// asking two places, or views far apart, for no more support than they can give.
StereoOptions OptionsFor(const Workspace& workspace, StereoOptions options) {
  if (options.polarization && options.polarization_evidence == "noise" && workspace.polarized)
    options.polarization = AopIsInformative(workspace, options.masks, options.aop_noise_deg);
  if (options.schedule != "checkerboard" || !CanRefine(ViewsOfWorkspace(workspace), RefinementBy(options)))
    options.surfaces = 0;
  const std::vector<int> places = Places(workspace.views);
  const bool two = std::set<int>(places.begin(), places.end()).size() == 2;
  if (two || NeighbourAngle(workspace.views) > kFarApart)
    options.filter_min_support = std::min(options.filter_min_support, kSupportOfTwo);
  return options;
}

void WarnOfPolarization(const Workspace& workspace, const StereoOptions& asked, const StereoOptions& options,
                        Progress& progress) {
  if (asked.polarization && !options.polarization)
    progress.Warn("the pictures' polarization is nothing but noise: it is left out, as by --no-polarization");
  if (!workspace.polarized && options.polarization)
    progress.Warn("the pictures hold no polarization: the polarization term is neglected");
}

// Of views that are not chosen now: maps of an earlier run with other options.
void RemoveOtherMaps(const Workspace& all, const Workspace& chosen) {
  for (int view = 0; view < int(all.views.size()); ++view) {
    const std::string& name = all.views[std::size_t(view)].name;
    if (std::ranges::binary_search(chosen.views, name, {}, &DenseView::name)) continue;
    fs::remove(all.DepthPath(view, kFinalMaps));
    fs::remove(all.NormalPath(view, kFinalMaps));
  }
}

// Of an earlier run, and those on the way to the result.
void RemoveMapsLeft(StepRunner& steps) {
  DoneList& done = steps.done();
  RemovePassingMaps(steps.workspace());
  done.Remove(kSeparateMaps);
  done.KeepOnly(kFinalMaps);
}

void MakeSeparateMaps(StepRunner& steps) {
  const std::string& schedule = steps.options().schedule;
  if (schedule == "checkerboard")
    RunMultilevel(steps);
  else if (schedule == "acmmp")
    RunAcmmp(steps);
  else if (schedule == "polarimetric-mvs")
    RunPolarimetricMvs(steps);
  else
    RunSequential(steps);
}

// Returns false where the poses turn out to be far off; better ones are known then.
bool MakeMaps(const Workspace& workspace, const StereoOptions& options, std::uint64_t inputs,
              const Shard& shard, Progress& progress) {
  const RefinedPoses refined = KnownPoses(workspace, ToHex(inputs));
  if (shard.count == 1 && refined.start.empty() && refined.fits.empty())
    RemoveRefinedPoses(workspace.folder);  // of an earlier run
  StepRunner steps(WithPoses(workspace, refined, 0), options, WithStart(inputs, refined), shard, progress);

  // 1. Maps of each view, from its neighbours: coarse to fine, or in the passes of the paper. Not again where
  //    those for the surfaces are there: a single program would forget the surfaces' maps.
  const bool surfaces = options.surfaces > 0, done = surfaces && steps.done().IsDone(kFinalMaps);
  const bool separate = surfaces && steps.alone() && steps.done().IsDone(kSeparateMaps);
  if (!done && !separate) MakeSeparateMaps(steps);
  if (!steps.alone() || !surfaces) return true;

  // 2. The surface common to all views, which the poses are fitted to, drawn into each map; and the filter.
  if (!done && !RunSurfaceSteps(steps, refined)) return false;

  // 3. What is left of the way.
  RemoveMapsLeft(steps);
  return true;
}

}  // namespace

void EstimateMaps(const fs::path& dense, const StereoOptions& asked, Progress& progress, const Shard& shard) {
  // 1. The views that are asked for, each cut to its object; the options that help them; what is wrong with all
  //    views' polarization.
  const Workspace all = ReadWorkspaceAsGiven(dense);
  Workspace workspace = ChosenViews(all, asked.views);
  const StereoOptions options = OptionsFor(workspace, asked);
  WarnOfPolarization(workspace, asked, options, progress);
  const std::uint64_t inputs = StereoInputHash(workspace, options);
  workspace.correction = FindCorrection(workspace, options, inputs, shard, progress);
  const std::uint64_t corrected = WithCorrection(inputs, workspace.correction);
  if (!options.refine_poses || options.surfaces == 0) RemoveRefinedPoses(dense);

  // 2. All maps; once more, where they show that the poses are far off.
  const Workspace cut = CutToObject(workspace, options);
  while (!MakeMaps(cut, options, corrected, shard, progress)) {
  }

  // 3. Maps of views that are not asked for. Last, so that nothing is lost if this run fails.
  if (shard.count == 1) RemoveOtherMaps(all, workspace);
}

StereoPlan PlanMaps(const fs::path& dense, const StereoOptions& asked) {
  Workspace workspace = ChosenViews(ReadWorkspaceAsGiven(dense), asked.views);
  const StereoOptions options = OptionsFor(workspace, asked);
  const std::uint64_t inputs = StereoInputHash(workspace, options);
  workspace.correction = KnownCorrection(workspace, inputs).value_or(PolarizationCorrection());
  StereoPlan plan{int(workspace.views.size()), ObjectPixels(workspace, options), {}};
  if (options.schedule == "checkerboard") {
    plan.steps = MultilevelSteps(workspace, options);
    if (options.surfaces > 0) plan.steps.push_back({"maps from the common surface", kFinalMaps});
  } else if (options.schedule == "acmmp") {
    plan.steps = AcmmpSteps(workspace, options);
  } else if (options.schedule == "polarimetric-mvs") {
    plan.steps = PolarimetricMvsSteps();
  } else {
    plan.steps = {{"photometric pass", kPhotometricMaps}};
    if (options.geometric_iterations > 0) plan.steps.push_back({"geometric pass", kFinalMaps});
  }
  const std::uint64_t corrected = WithCorrection(inputs, workspace.correction);
  const DoneList done(workspace, WithStart(corrected, KnownPoses(workspace, ToHex(corrected))));
  for (StereoStep& step : plan.steps) step.done = done.Count(step.kind);
  return plan;
}

std::uint64_t StereoInputHash(const Workspace& workspace, const StereoOptions& options) {
  constexpr const char* kSteps =
      "cut to the object, grids for the surface";  // another text where maps of steps are of another kind
  std::uint64_t hash = Hash(ToText(ValuesOf(options)), Hash(kSteps));
  hash = HashFile(workspace.folder / "views.json", hash);
  for (int view = 0; view < int(workspace.views.size()); ++view) {
    hash = HashFile(workspace.LightPath(view), hash);
    if (options.masks && fs::exists(workspace.MaskPath(view)))
      hash = HashFile(workspace.MaskPath(view), hash);
  }
  return hash;
}

}  // namespace polarscan
