// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/schedules/sequential.h"

#include <array>
#include <cmath>
#include <utility>

#include "pipeline/stereo/stage_inputs.h"
#include "stereo/costs/hull_intervals.h"
#include "stereo/dense/load_view.h"
#include "stereo/search/continuous.h"
#include "stereo/search/filter.h"
#include "stereo/search/sweep.h"

namespace polarscan {
namespace {

// Along rows and back, along columns and back (section 3.1); or turned by 90 degrees each time, as in COLMAP.
constexpr std::array<std::pair<int, int>, 4> kPaired = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}},
                                             kTurning = {{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};

struct Pass {
  bool geometric;
  int first_sweep, iterations;
};

class SequentialPasses {
 public:
  explicit SequentialPasses(StepRunner& steps)
      : steps_(steps),
        views_(CachedViews(steps.workspace(), steps.options(), GrayScale(steps.workspace()))),
        maps_(CachedMaps(steps.options(),
                         [&](int v) { return ReadMaps(steps.workspace(), v, kPhotometricMaps); })) {}

  // Four sweeps an iteration.
  DepthNormalMap Estimate(int view, const Pass& pass) {
    const Workspace& workspace = steps_.workspace();
    const StereoOptions& options = steps_.options();
    const auto reference = views_.Get(view);
    const Problem problem =
        MakeProblem(workspace, view, options, *reference, views_, pass.geometric ? &maps_ : nullptr);
    const bool warm = pass.geometric && options.warm_geometric_pass;
    const Image<DepthInterval> hull =
        VisualHull(problem, warm ? std::vector<Source>{}
                                 : SourcesWithSilhouettes(workspace, view, options, *reference, views_));
    MatchState state = InitialState(problem, options, hull, pass.geometric ? maps_.Get(view).get() : nullptr);
    for (int i = 0; i < 4 * pass.iterations; ++i) {
      const auto [dx, dy] = (options.paired_sweeps ? kPaired : kTurning)[i % 4];
      const Sweep sweep{dx,
                        dy,
                        (warm ? 0.25f : 1) * std::exp2(-float(i) / 4),
                        float(i) / float(4 * pass.iterations),
                        warm ? 0.01f : 0,
                        pass.first_sweep + i};
      RunSweep(problem, options, hull, sweep, state, steps_.progress());
    }
    const bool last = pass.geometric || options.geometric_iterations == 0;
    if (last && options.continuous_iterations > 0)
      RefineContinuously(problem, options, state.selection, state.map, steps_.progress());
    if (last && options.filter) FilterEstimates(problem, options, state.selection, state.map);
    return std::move(state.map);
  }

 private:
  const StepRunner& steps_;
  Cache<StereoView> views_;
  Cache<DepthNormalMap> maps_;
};

}  // namespace

void RunSequential(StepRunner& steps) {
  SequentialPasses passes(steps);
  const auto run = [&](const char* title, const MapKind& kind, const Pass& pass) {
    steps.Run(title, kind, [&](int view) { return passes.Estimate(view, pass); });
  };
  const StereoOptions& options = steps.options();
  run("photometric pass", kPhotometricMaps, {false, 0, options.photometric_iterations});
  if (options.geometric_iterations > 0)
    run("geometric pass", kFinalMaps,
        {true, 4 * options.photometric_iterations, options.geometric_iterations});
  else
    steps.done().Remove(kFinalMaps);  // of an earlier run: they would go before the photometric ones
}

}  // namespace polarscan
