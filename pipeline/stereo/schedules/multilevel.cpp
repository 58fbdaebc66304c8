// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/schedules/multilevel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "pipeline/stereo/schedules/enlarge.h"
#include "pipeline/stereo/stage_inputs.h"
#include "stereo/dense/levels.h"
#include "stereo/dense/load_view.h"
#include "stereo/rounds/round.h"
#include "stereo/rounds/surface_matching.h"
#include "stereo/search/checkerboard.h"
#include "stereo/search/filter.h"

namespace polarscan {
namespace {

enum class Work { kSearch, kMatching, kRound };

// kind: of its maps; those of `before` are its input (none: there are none).
struct Step {
  Work work;
  MapKind kind;
  std::optional<MapKind> before;
  std::string title;
  int halvings = 0, halvings_before = 0;
  int index = 0;        // among the searches: key of the random numbers
  float sharpness = 1;  // of a round
};

// The coarsest level: a search, then rounds. Finer ones: a search while there are search levels left, then
// refinements, each of them a matching on the surface and a round; so does the only level if it shows enough.
std::vector<Step> PlanSteps(const StereoOptions& options, const Levels& levels) {
  std::vector<Step> steps;
  int halvings = levels.count - 1, searches = 0;
  const auto add = [&](Work work, const std::string& name, float sharpness = 1) {
    const std::string size = halvings ? fmt::format("1/{} size", 1 << halvings) : "full size";
    Step step{work,     {MapStage::kStep, int(steps.size())},
              {},       fmt::format("{} at {}", name, size),
              halvings, halvings,
              searches, sharpness};
    if (!steps.empty()) step.before = steps.back().kind, step.halvings_before = steps.back().halvings;
    steps.push_back(step);
  };
  add(Work::kSearch, "search");
  for (int round = 1; round <= options.rounds; ++round)
    add(Work::kRound, fmt::format("round {}", round), round == 1 ? 1.0f : 0.7f);
  const auto refine = [&] {
    for (int i = 1; i <= options.refinements; ++i) {
      add(Work::kMatching, fmt::format("matching {}", i));
      if (options.rounds > 0) add(Work::kRound, fmt::format("round after matching {}", i), 0.5f);
    }
  };
  if (levels.match_coarsest) refine();
  while (--halvings >= 0) {
    const bool search = ++searches < options.search_levels;
    if (search) add(Work::kSearch, "search");
    if (search && options.rounds > 0) add(Work::kRound, "round after the search", 0.5f);
    refine();
  }
  steps.back().kind = options.surfaces > 0 ? kSeparateMaps : kFinalMaps;
  return steps;
}

class MultilevelSchedule {
 public:
  explicit MultilevelSchedule(StepRunner& steps)
      : steps_(steps),
        scale_(GrayScale(steps.workspace())),
        plan_(PlanSteps(steps.options(), ChooseLevels(steps.workspace(), steps.options()))) {}

  void Run() {
    steps_.RunFromLastDone(plan_, [this](const Step& step) { Run(step); });
  }

  CoarseMaps RunCoarsest() {
    const std::vector<Step> coarsest(plan_.begin(), plan_.begin() + 1 + options().rounds);
    steps_.RunUntil(coarsest, [this](const Step& step) { Run(step); });
    return {coarsest.back().kind, coarsest.back().halvings};
  }

 private:
  const Workspace& workspace() const { return steps_.workspace(); }
  const StereoOptions& options() const { return steps_.options(); }

  // Whether these maps are the result, and to be filtered if so.
  bool IsFiltered(const Step& step) const { return options().filter && step.kind == kFinalMaps; }

  void Run(const Step& step) {
    if (!views_ || views_halvings_ != step.halvings)  // kept from step to step
      views_.emplace(CachedViews(workspace(), options(), scale_, step.halvings));
    views_halvings_ = step.halvings;
    Cache<DepthNormalMap> maps = CachedMaps(options(), [&](int view) { return MapsBefore(step, view); });
    steps_.Run(step.title, step.kind, [&](int view) { return Estimate(step, view, maps); });
  }

  // The maps of the step before, at this step's size.
  DepthNormalMap MapsBefore(const Step& step, int view) const {
    DepthNormalMap map = ReadMaps(workspace(), view, *step.before);
    if (step.halvings == step.halvings_before) return map;
    Pinhole camera = workspace().views[std::size_t(view)].camera;
    for (int i = 0; i < step.halvings; ++i) camera = HalfCamera(camera);
    return Enlarged(map, camera);
  }

  DepthNormalMap Estimate(const Step& step, int view, Cache<DepthNormalMap>& maps) {
    if (step.work == Work::kSearch) return Search(step, view, maps);
    return step.work == Work::kMatching ? Matching(step, view, maps) : Round(step, view, maps);
  }

  DepthNormalMap Search(const Step& step, int view, Cache<DepthNormalMap>& maps) {
    const bool warm = step.before.has_value();
    const auto reference = views_->Get(view);
    const Problem problem =
        MakeProblem(workspace(), view, options(), *reference, *views_, warm ? &maps : nullptr);
    const Image<DepthInterval> hull =
        VisualHull(problem, warm ? std::vector<Source>{}
                                 : SourcesWithSilhouettes(workspace(), view, options(), *reference, *views_));
    DepthNormalMap map;
    if (warm) map = *maps.Get(view);
    const CheckerboardPass pass{warm ? options().geometric_iterations : options().photometric_iterations,
                                warm, 100 * step.index};
    RunCheckerboard(problem, options(), hull, pass, map, steps_.progress());
    if (IsFiltered(step)) FilterEstimates(problem, options(), {}, map);
    return map;
  }

  DepthNormalMap Matching(const Step& step, int view, Cache<DepthNormalMap>& maps) {
    const auto reference = views_->Get(view);
    const Problem problem = MakeProblem(workspace(), view, options(), *reference, *views_, &maps);
    const auto own = maps.Get(view);
    SurfaceMatchingOptions matching;
    matching.chosen_sources = options().matching_sources;
    matching.window_px = float(options().matching_window_px);
    matching.smoothing_px = float(options().matching_smoothing_px);
    matching.epsilon = float(options().ncc_epsilon);
    DepthNormalMap map{MatchSurface(problem, *own, matching), own->normal};
    if (IsFiltered(step)) FilterEstimates(problem, options(), {}, map);
    return map;
  }

  DepthNormalMap Round(const Step& step, int view, Cache<DepthNormalMap>& maps) {
    const auto reference = views_->Get(view);
    const Problem problem = VotersProblem(workspace(), view, options(), *reference, *views_, maps);
    const auto own = maps.Get(view);
    RoundResult result = RunRound(problem, *own, options(), step.sharpness);
    if (IsFiltered(step)) FilterBySupport(problem, options(), result.confidence, result.map);
    return std::move(result.map);
  }

  StepRunner& steps_;
  const float scale_;
  const std::vector<Step> plan_;
  std::optional<Cache<StereoView>> views_;
  int views_halvings_ = 0;
};

}  // namespace

std::vector<StereoStep> MultilevelSteps(const Workspace& workspace, const StereoOptions& options) {
  std::vector<StereoStep> steps;
  for (const Step& step : PlanSteps(options, ChooseLevels(workspace, options)))
    steps.push_back({step.title, step.kind});
  return steps;
}

void RunMultilevel(StepRunner& steps) { MultilevelSchedule(steps).Run(); }

CoarseMaps RunCoarsest(StepRunner& steps) { return MultilevelSchedule(steps).RunCoarsest(); }

}  // namespace polarscan
