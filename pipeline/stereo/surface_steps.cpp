// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/surface_steps.h"

#include <fmt/format.h>

#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "pipeline/stereo/common_surface.h"
#include "pipeline/stereo/corrections/pose_refinement.h"
#include "pipeline/stereo/stage_inputs.h"
#include "stereo/dense/load_view.h"
#include "stereo/map_io.h"
#include "stereo/rounds/vote.h"
#include "stereo/search/filter.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// Of a step's maps from the common surface, numbered from 1.
MapKind SurfaceMaps(int number) { return {MapStage::kSurface, number}; }

// Of the depths that both kinds of maps hold, in sizes of a pixel there.
double MeanChange(const Workspace& workspace, const MapKind& before, const MapKind& after) {
  const std::size_t count = workspace.views.size();
  std::vector<double> sums(count), pixels(count);
  ParallelFor(0, int(count), [&](int view) {
    const Image<float> old_depth = ReadDepthMap(workspace.DepthPath(view, before)),
                       new_depth = ReadDepthMap(workspace.DepthPath(view, after));
    const double focal = workspace.views[std::size_t(view)].camera.fx;
    for (std::size_t i = 0; i < new_depth.size(); ++i) {
      const double a = old_depth.pixels()[i], b = new_depth.pixels()[i];
      if (a <= 0 || b <= 0) continue;
      sums[std::size_t(view)] += focal * std::abs(b / a - 1), ++pixels[std::size_t(view)];
    }
  });
  const double all = std::accumulate(pixels.begin(), pixels.end(), 0.0);
  return all > 0 ? std::accumulate(sums.begin(), sums.end(), 0.0) / all : 0;
}

// Those that were refined from the same inputs.
std::optional<RefinedPoses> KnownPoses(const Workspace& workspace, const std::string& inputs) {
  std::optional<RefinedPoses> refined = ReadRefinedPoses(workspace.folder);
  if (refined && refined->inputs != inputs) refined.reset();
  return refined;
}

// None, with a warning, if the maps make none.
std::optional<CommonSurface> TryCommonSurface(const StepRunner& steps, const Workspace& workspace,
                                              const MapKind& maps) {
  try {
    return MakeCommonSurface(workspace, maps, steps.options(), steps.progress());
  } catch (const NothingFound& error) {
    steps.progress().Warn(
        fmt::format("the views' maps stay separate, which is less accurate: {}", error.what()));
    return {};
  }
}

// Makes the maps `after` of those `before`. Returns false if they make no surface, and are the same. workspace: the
// steps', with the poses that are known by now; the first surface refines them (inputs: what it is made from).
bool Draw(StepRunner& steps, const MapKind& before, const MapKind& after, bool try_surface,
          const std::string& inputs, Workspace& workspace) {
  if (steps.done().IsDone(after)) return try_surface;
  const std::optional<CommonSurface> surface =
      try_surface ? TryCommonSurface(steps, before == kSeparateMaps ? steps.workspace() : workspace, before)
                  : std::optional<CommonSurface>();
  if (surface && before == kSeparateMaps && steps.options().refine_poses && !KnownPoses(workspace, inputs))
    workspace = WithPoses(workspace, RefinePoses(surface->caster.meshes()[0], steps.workspace(),
                                                 steps.options(), inputs, steps.progress()));
  steps.Run("maps from the surface", after, [&](int view) {
    const DepthNormalMap own = ReadMaps(workspace, view, before);
    const bool masked = steps.options().masks && fs::exists(workspace.MaskPath(view));
    return surface ? Drawn(*surface, workspace.views[std::size_t(view)], masked, own) : own;
  });
  return surface.has_value();
}

// By the support that the other views' separate maps give these depths.
void Filter(StepRunner& steps, const Workspace& workspace, const MapKind& before) {
  const StereoOptions& options = steps.options();
  Cache<StereoView> views = CachedViews(workspace, options, GrayScale(workspace));
  Cache<DepthNormalMap> separate =
      CachedMaps(options, [&](int view) { return ReadMaps(workspace, view, kSeparateMaps); });
  steps.Run("filter", kFinalMaps, [&](int view) {
    DepthNormalMap map = ReadMaps(workspace, view, before);
    const auto reference = views.Get(view);
    const Problem problem = VotersProblem(workspace, view, options, *reference, views, separate);
    const Image<float> support =
        SupportOf(map.depth, problem, *separate.Get(view), 2 * float(options.vote_sigma));
    FilterBySupport(problem, options, support, map);
    return map;
  });
}

}  // namespace

void RunSurfaceSteps(StepRunner& steps, const std::string& inputs) {
  const StereoOptions& options = steps.options();
  Workspace workspace = steps.workspace();
  if (const auto known = KnownPoses(workspace, inputs))
    workspace = WithPoses(workspace, *known);
  else
    RemoveRefinedPoses(workspace.folder);  // of an earlier run
  MapKind maps = kSeparateMaps;
  bool try_surface = true;
  for (int number = 1; number <= options.surfaces; ++number) {
    const MapKind before = std::exchange(maps, SurfaceMaps(number));
    try_surface = Draw(steps, before, maps, try_surface, inputs, workspace);
    const bool asks = number > 1 && number < options.surfaces;
    if (asks && MeanChange(workspace, before, maps) < options.surface_change_px) break;
  }
  if (options.filter)
    Filter(steps, workspace, maps);  // after the drawing: the surface is gone from memory
  else
    steps.Run("final maps", kFinalMaps, [&](int view) { return ReadMaps(steps.workspace(), view, maps); });
}

}  // namespace polarscan
