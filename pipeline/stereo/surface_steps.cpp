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

// Fits the poses to the first two surfaces, the second one if the first changed any.
bool FitsPosesTo(int number, const StereoOptions& options, const RefinedPoses& refined) {
  constexpr int kFits = 2;
  return options.refine_poses && number <= kFits && int(refined.fits.size()) < number &&
         (number == 1 || refined.Any());
}

// The surface of a step's maps, numbered from 1. None, with a warning, if the maps make none. Before the first one is
// refined, which draws its outlines to all masks, it tells of views that are far off: then they are refined's start.
std::optional<CommonSurface> TryCommonSurface(const StepRunner& steps, int number, const MapKind& maps,
                                              HullSupport& hull, RefinedPoses& refined) {
  const Workspace before = WithPoses(steps.workspace(), refined, std::size_t(number - 1));
  const auto goes_on = [&](const TriangleMesh& unrefined) {
    if (number > 1 || !FitsPosesTo(number, steps.options(), refined) || !refined.start.empty()) return true;
    RefinedPoses trial = refined;
    AddPoseFit(unrefined, before, steps.options(), kUselessPx, trial, steps.progress());
    if (!BeginsAnew(before, trial)) return true;
    refined = trial;
    return false;
  };
  try {
    return MakeCommonSurface(before, maps, steps.options(), hull, goes_on, steps.progress());
  } catch (const NothingFound& error) {
    steps.progress().Warn(
        fmt::format("the views' maps stay separate, which is less accurate: {}", error.what()));
    return {};
  }
}

enum class Drawing { kDone, kNoSurface, kBeginsAnew };

// Makes the maps of a surface, numbered from 1, of those `before`. With no surface they are the same.
Drawing Draw(StepRunner& steps, int number, const MapKind& before, bool try_surface, HullSupport& hull,
             RefinedPoses& refined) {
  const MapKind after = SurfaceMaps(number);
  if (steps.done().IsDone(after)) return try_surface ? Drawing::kDone : Drawing::kNoSurface;
  const bool begun_anew = !refined.start.empty();
  const std::optional<CommonSurface> surface =
      try_surface ? TryCommonSurface(steps, number, before, hull, refined) : std::optional<CommonSurface>();
  if (!refined.start.empty() != begun_anew) return Drawing::kBeginsAnew;
  if (surface && FitsPosesTo(number, steps.options(), refined)) {
    const Workspace posed = WithPoses(steps.workspace(), refined, std::size_t(number - 1));
    AddPoseFit(surface->caster.meshes()[0], posed, steps.options(), 0, refined, steps.progress());
    WriteRefinedPoses(posed.folder, refined);
  }
  const Workspace workspace = WithPoses(steps.workspace(), refined, std::size_t(number));
  steps.Run("maps from the surface", after, [&](int view) {
    const DepthNormalMap own = ReadMaps(workspace, view, before);
    const bool masked = steps.options().masks && fs::exists(workspace.MaskPath(view));
    return surface ? Drawn(*surface, workspace.views[std::size_t(view)], masked, own) : own;
  });
  return surface ? Drawing::kDone : Drawing::kNoSurface;
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

bool RunSurfaceSteps(StepRunner& steps, RefinedPoses refined) {
  const StereoOptions& options = steps.options();
  MapKind maps = kSeparateMaps;
  bool try_surface = true;
  HullSupport hull(RefinementBy(options));
  for (int number = 1; number <= options.surfaces; ++number) {
    const MapKind before = std::exchange(maps, SurfaceMaps(number));
    const Drawing drawing = Draw(steps, number, before, try_surface, hull, refined);
    if (drawing == Drawing::kBeginsAnew) return false;
    try_surface = drawing == Drawing::kDone;
    const bool asks = number > 1 && number < options.surfaces;
    if (asks && MeanChange(steps.workspace(), before, maps) < options.surface_change_px) break;
  }
  const Workspace workspace = WithPoses(steps.workspace(), refined);
  if (options.filter)
    Filter(steps, workspace, maps);  // after the drawing: the surface is gone from memory
  else
    steps.Run("final maps", kFinalMaps, [&](int view) { return ReadMaps(workspace, view, maps); });
  return true;
}

}  // namespace polarscan
