// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/schedules/acmmp.h"

#include <fmt/format.h>

#include "pipeline/stereo/schedules/enlarge.h"
#include "pipeline/stereo/stage_inputs.h"
#include "stereo/dense/levels.h"
#include "stereo/dense/load_view.h"
#include "stereo/search/acmh.h"
#include "stereo/search/filter.h"
#include "stereo/search/planar_prior.h"

namespace polarscan {
namespace {

constexpr int kGeometricSteps = 2;

struct AcmmpStep {
  MapKind kind;
  std::string title;
  bool geometric = false;
  int halvings = 0, halvings_before = 0;
  int index = 0;  // key of the random numbers
};

std::vector<AcmmpStep> PlanAcmmp(const StereoOptions& options, const Workspace& workspace) {
  std::vector<AcmmpStep> steps;
  for (int halvings = ChooseLevels(workspace, options).count - 1; halvings >= 0; --halvings) {
    const std::string size = halvings ? fmt::format("1/{} size", 1 << halvings) : "full size";
    for (int i = 0; i <= kGeometricSteps; ++i) {
      AcmmpStep step{{MapStage::kStep, int(steps.size())},
                     i ? fmt::format("geometric pass {} at {}", i, size) : "photometric pass at " + size,
                     i > 0,
                     halvings,
                     halvings,
                     int(steps.size())};
      if (!steps.empty()) step.halvings_before = steps.back().halvings;
      steps.push_back(step);
    }
  }
  steps.back().kind = kFinalMaps;
  return steps;
}

class Acmmp {
 public:
  explicit Acmmp(StepRunner& steps)
      : steps_(steps),
        scale_(GrayScale(steps.workspace())),
        plan_(PlanAcmmp(steps.options(), steps.workspace())) {}

  void Run() {
    steps_.RunFromLastDone(plan_, [this](const AcmmpStep& step) { Run(step); });
  }

 private:
  const Workspace& workspace() const { return steps_.workspace(); }
  const StereoOptions& options() const { return steps_.options(); }
  const Progress& progress() const { return steps_.progress(); }

  void Run(const AcmmpStep& step) {
    Cache<StereoView> views = CachedViews(workspace(), options(), scale_, step.halvings);
    const auto read = [&](int view) {
      return ReadMaps(workspace(), view, plan_[std::size_t(step.index) - 1].kind);
    };
    Cache<DepthNormalMap> maps = CachedMaps(options(), read);
    steps_.Run(step.title, step.kind, [&](int view) {
      const auto reference = views.Get(view);
      if (step.geometric) {
        const Problem problem = MakeProblem(workspace(), view, options(), *reference, views, &maps);
        return Geometric(step, problem, *maps.Get(view));
      }
      const Problem problem = MakeProblem(workspace(), view, options(), *reference, views, nullptr);
      if (step.index == 0) return Photometric(step, problem, {});
      const StereoView half = LoadStereoView(workspace(), view, scale_, options(), step.halvings_before);
      return Photometric(step, problem,
                         EnlargedByGray(*maps.Get(view), reference->camera, reference->gray, half.gray));
    });
  }

  // start: from a coarser size; empty: none.
  DepthNormalMap Photometric(const AcmmpStep& step, const Problem& problem,
                             const DepthNormalMap& start) const {
    const int turns = options().photometric_iterations;
    CostedMap state = StartAcmh(problem, options(), {}, progress());
    RunAcmh(problem, options(), {turns, 1000 * step.index, nullptr}, state, progress());
    if (!start.depth.empty()) RestoreDetails(problem, start, state);
    const DepthNormalMap prior = PlanarPrior(problem, state);
    RunAcmh(problem, options(), {turns, 1000 * step.index + turns, &prior}, state, progress());
    return std::move(state.map);
  }

  // What came from the coarser size, but where the search at this size matches clearly better.
  void RestoreDetails(const Problem& problem, const DepthNormalMap& start, CostedMap& state) const {
    constexpr float kBetter = 0.1f;
    CostedMap coarse = StartAcmh(problem, options(), start, progress());
    const CostedMap fine = StartAcmh(problem, options(), state.map, progress());  // by the same sources' rule
    for (std::size_t i = 0; i < coarse.cost.size(); ++i) {
      if (coarse.cost.pixels()[i] - fine.cost.pixels()[i] <= kBetter) continue;
      coarse.cost.pixels()[i] = fine.cost.pixels()[i];
      coarse.map.depth.pixels()[i] = fine.map.depth.pixels()[i];
      coarse.map.normal.pixels()[i] = fine.map.normal.pixels()[i];
    }
    state = std::move(coarse);
  }

  DepthNormalMap Geometric(const AcmmpStep& step, const Problem& problem,
                           const DepthNormalMap& before) const {
    CostedMap state = StartAcmh(problem, options(), before, progress());
    RunAcmh(problem, options(), {options().geometric_iterations, 1000 * step.index, nullptr}, state,
            progress());
    if (options().filter && step.kind == kFinalMaps) FilterEstimates(problem, options(), {}, state.map);
    return std::move(state.map);
  }

  StepRunner& steps_;
  const float scale_;
  const std::vector<AcmmpStep> plan_;
};

}  // namespace

std::vector<StereoStep> AcmmpSteps(const Workspace& workspace, const StereoOptions& options) {
  std::vector<StereoStep> steps;
  for (const AcmmpStep& step : PlanAcmmp(options, workspace)) steps.push_back({step.title, step.kind});
  return steps;
}

void RunAcmmp(StepRunner& steps) { Acmmp(steps).Run(); }

}  // namespace polarscan
