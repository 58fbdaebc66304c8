// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/stereo.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>

#include "core/files/files.h"
#include "pipeline/stereo/acmmp.h"
#include "pipeline/stereo/common_surface.h"
#include "pipeline/stereo/multilevel.h"
#include "pipeline/stereo/polarization_fit.h"
#include "pipeline/stereo/sequential.h"
#include "pipeline/stereo/stage_inputs.h"
#include "pipeline/stereo/surface_steps.h"
#include "pipeline/workspace_views.h"
#include "stereo/dense/crop.h"
#include "stereo/dense/levels.h"
#include "stereo/dense/load_view.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr double kSupportOfTwo = 1.2;  // a view gives 1 at most: more than one alone, though both look askew

// Without polarization where it is nothing but noise, without surfaces where nothing could refine one, and
// asking two places for no more support than they can give.
StereoOptions OptionsFor(const Workspace& workspace, StereoOptions options) {
  if (options.polarization && options.polarization_evidence == "noise" && workspace.polarized)
    options.polarization = AopIsInformative(workspace, options.masks, options.aop_noise_deg);
  if (options.schedule != "checkerboard" || !CanRefine(ViewsOfWorkspace(workspace), RefinementBy(options)))
    options.surfaces = 0;
  const std::vector<int> places = Places(workspace.views);
  if (std::set<int>(places.begin(), places.end()).size() == 2)
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

// The workspace, with no polarization corrected.
Workspace ReadAsGiven(const fs::path& dense) {
  Workspace workspace = ReadWorkspace(dense);
  workspace.correction = {};
  return workspace;
}

// The correction that was found from these inputs and options; none if it was not looked for.
std::optional<PolarizationCorrection> KnownCorrection(const Workspace& as_given,
                                                      const StereoOptions& options) {
  const auto found = ReadCorrection(as_given);
  if (!found || found->inputs != ToHex(StereoInputHash(as_given, options))) return std::nullopt;
  return found->correction;
}

// Asks the maps of the coarsest size. Where they leave a doubt, again maps that are made without polarization; a turn
// that those find is made better once by maps that are made with it.
PolarizationCorrection AskShape(const Workspace& as_given, const StereoOptions& options, const Shard& shard,
                                Progress& progress) {
  const auto ask = [&](const Workspace& workspace, const StereoOptions& by, auto question) {
    StepRunner steps(CutToObject(workspace, by), by, StereoInputHash(workspace, by), shard, progress);
    const CoarseMaps coarse = RunCoarsest(steps);
    return question(steps.workspace(), coarse.kind, coarse.halvings, progress);
  };
  if (!ask(as_given, options, FitPolarization).doubtful) return {};
  StereoOptions without = options;
  without.polarization = false;
  Workspace corrected = as_given;
  corrected.correction = ask(as_given, without, FitPolarization).correction;
  if (corrected.correction.turn_deg == 0) return corrected.correction;
  return ask(corrected, options, RefinedTurn);
}

// Looks for it if it is not known. Of several shards the first one's counts for all.
PolarizationCorrection FindCorrection(const Workspace& as_given, const StereoOptions& options,
                                      const Shard& shard, Progress& progress) {
  if (options.schedule != "checkerboard" || !options.fit_polarization || !options.polarization ||
      !as_given.polarized || options.rounds == 0)
    return {};
  if (const auto known = KnownCorrection(as_given, options)) return *known;
  const std::uint64_t inputs = StereoInputHash(as_given, options);
  {
    const DoneList done(as_given, inputs, shard);
    if (done.IsDone(kFinalMaps) || done.IsDone(kSeparateMaps))
      return {};  // by a program that did not look for it
  }
  const PolarizationCorrection correction = AskShape(as_given, options, shard, progress);
  if (const auto known = KnownCorrection(as_given, options)) return *known;
  WriteCorrection(as_given, {correction, ToHex(inputs)});
  return correction;
}

}  // namespace

void EstimateMaps(const fs::path& dense, const StereoOptions& asked, Progress& progress, const Shard& shard) {
  // 1. The views that are asked for, each cut to its object; the options that help them; what is wrong with all
  //    views' polarization.
  const Workspace all = ReadAsGiven(dense);
  Workspace workspace = ChosenViews(all, asked.views);
  const StereoOptions options = OptionsFor(workspace, asked);
  WarnOfPolarization(workspace, asked, options, progress);
  workspace.correction = FindCorrection(workspace, options, shard, progress);
  StepRunner steps(CutToObject(workspace, options), options, StereoInputHash(workspace, options), shard,
                   progress);

  // 2. Maps of each view, from its neighbours: coarse to fine, or in the passes of the paper. Not again where
  //    those for the surfaces are there: a single program would forget the surfaces' maps.
  const bool surfaces = options.surfaces > 0, done = surfaces && steps.done().IsDone(kFinalMaps);
  const bool separate = surfaces && steps.alone() && steps.done().IsDone(kSeparateMaps);
  if (!done && !separate) {
    if (options.schedule == "checkerboard")
      RunMultilevel(steps);
    else if (options.schedule == "acmmp")
      RunAcmmp(steps);
    else
      RunSequential(steps);
  }
  if (!steps.alone()) return;

  // 3. The surface common to all views, drawn into each map; and the filter.
  if (surfaces && !done) RunSurfaceSteps(steps);

  // 4. What is left of the way. Last, so that nothing is lost if this run fails.
  if (surfaces) RemoveMapsLeft(steps);
  RemoveOtherMaps(all, workspace);
}

StereoPlan PlanMaps(const fs::path& dense, const StereoOptions& asked) {
  Workspace workspace = ChosenViews(ReadAsGiven(dense), asked.views);
  const StereoOptions options = OptionsFor(workspace, asked);
  workspace.correction = KnownCorrection(workspace, options).value_or(PolarizationCorrection());
  StereoPlan plan{int(workspace.views.size()), ObjectPixels(workspace, options), {}};
  if (options.schedule == "checkerboard") {
    plan.steps = MultilevelSteps(workspace, options);
    if (options.surfaces > 0) plan.steps.push_back({"maps from the common surface", kFinalMaps});
  } else if (options.schedule == "acmmp") {
    plan.steps = AcmmpSteps(workspace, options);
  } else {
    plan.steps = {{"photometric pass", kPhotometricMaps}};
    if (options.geometric_iterations > 0) plan.steps.push_back({"geometric pass", kFinalMaps});
  }
  const DoneList done(workspace, StereoInputHash(workspace, options));
  for (StereoStep& step : plan.steps) step.done = done.Count(step.kind);
  return plan;
}

std::uint64_t StereoInputHash(const Workspace& workspace, const StereoOptions& options) {
  constexpr const char* kSteps =
      "cut to the object, grids for the surface";  // another text where maps of steps are of another kind
  std::uint64_t hash = Hash(ToText(ValuesOf(options)), Hash(kSteps));
  hash = HashFile(workspace.folder / "views.json", hash);
  const PolarizationCorrection& c = workspace.correction;
  if (c != PolarizationCorrection())
    hash = Hash(fmt::format("{} {} {} {}", c.turn_deg, c.mirrored, c.bias_s1, c.bias_s2), hash);
  for (int view = 0; view < int(workspace.views.size()); ++view) {
    hash = HashFile(workspace.LightPath(view), hash);
    if (options.masks && fs::exists(workspace.MaskPath(view)))
      hash = HashFile(workspace.MaskPath(view), hash);
  }
  return hash;
}

}  // namespace polarscan
