// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/stereo.h"
#include "stereo/dense/load_view.h"

#include <fmt/format.h>

#include "core/files.h"
#include "pipeline/stereo/done_list.h"
#include "pipeline/stereo/multilevel.h"
#include "pipeline/stereo/stage_inputs.h"
#include "stereo/costs/hull.h"
#include "stereo/dense/crop.h"
#include "stereo/dense/levels.h"
#include "stereo/search/filter.h"
#include "stereo/search/sweep.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
constexpr const char* kPhotometric = "photometric";

// The paper's schedule: a photometric pass over all views, then a geometric one.
class SequentialStage {
 public:
  SequentialStage(const Workspace& workspace, const StereoOptions& options, std::uint64_t input_hash,
                  const Shard& shard, Progress& progress)
      : workspace_(workspace),
        options_(options),
        progress_(progress),
        scale_(GrayScale(workspace)),
        views_(
            CacheBytes() / 2, [this](int v) { return LoadStereoView(workspace_, v, scale_, options_); },
            [](const StereoView& v) { return BytesOf(v); }),
        maps_(
            CacheBytes() / 2, [this](int v) { return ReadMaps(workspace_, v, kPhotometric); },
            [](const DepthNormalMap& m) { return BytesOf(m); }),
        shard_(shard),
        done_(workspace, input_hash, shard) {}

  void RunPass(const std::string& kind, int first_sweep, int iterations) {
    const int count = int(workspace_.views.size());
    progress_.Begin(kind + " pass", std::size_t(shard_.Share(count)));
    for (int view = shard_.index; view < count; view += shard_.count) {
      progress_.Check();
      if (!done_.IsDone(view, kind)) EstimateView(view, kind, first_sweep, iterations);
      progress_.Advance();
    }
    done_.WaitForOthers(kind, progress_);
  }

  void RemoveMaps(const std::string& kind) { done_.Remove(kind); }

 private:
  std::size_t CacheBytes() const { return std::size_t(options_.cache_gb * 1e9); }

  // Four sweeps an iteration: row-major, column-major, and both in reverse (section 3.1).
  void EstimateView(int view, const std::string& kind, int first_sweep, int iterations) {
    const bool geometric = kind == kFinalMaps;
    const auto reference = views_.Get(view);
    const Problem problem =
        MakeProblem(workspace_, view, options_, *reference, views_, geometric ? &maps_ : nullptr);
    const bool warm = geometric && options_.warm_geometric_pass;
    const Image<DepthInterval> hull =
        VisualHull(problem, warm ? std::vector<Source>{}
                                 : SourcesWithSilhouettes(workspace_, view, options_, *reference, views_));
    MatchState state = InitialState(problem, options_, hull, geometric ? maps_.Get(view).get() : nullptr);
    constexpr int kDirections[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    for (int i = 0; i < 4 * iterations; ++i) {
      const Sweep sweep{kDirections[i % 4][0],
                        kDirections[i % 4][1],
                        (warm ? 0.25f : 1) * std::exp2(-float(i) / 4),
                        float(i) / float(4 * iterations),
                        warm ? 0.01f : 0,
                        first_sweep + i};
      RunSweep(problem, options_, hull, sweep, state, progress_);
    }
    const bool last = geometric || options_.geometric_iterations == 0;
    if (last && options_.filter) FilterEstimates(problem, options_, state.selection, state.map);
    WriteMaps(workspace_, view, kind, state.map);
    done_.Add(view, kind);
  }

  const Workspace& workspace_;
  const StereoOptions& options_;
  Progress& progress_;
  const float scale_;
  Cache<StereoView> views_;
  Cache<DepthNormalMap> maps_;
  const Shard shard_;
  DoneList done_;
};

}  // namespace

std::uint64_t StereoInputHash(const Workspace& workspace, StereoOptions options) {
  constexpr const char* kSteps =
      "cut to the object, grids for the surface";  // another text where maps of steps are of another kind
  std::uint64_t hash = Hash(ToText(ToJson(Table(options))), Hash(kSteps));
  hash = HashFile(workspace.folder / "views.json", hash);
  for (int view = 0; view < int(workspace.views.size()); ++view) {
    hash = HashFile(workspace.LightPath(view), hash);
    if (options.masks && fs::exists(workspace.MaskPath(view)))
      hash = HashFile(workspace.MaskPath(view), hash);
  }
  return hash;
}

StereoPlan PlanDepths(const fs::path& dense, const StereoOptions& options) {
  const Workspace workspace = ChosenViews(ReadWorkspace(dense), options.views);
  StereoPlan plan{int(workspace.views.size()), ObjectPixels(workspace, options), {}};
  if (options.schedule == "checkerboard")
    plan.steps = MultilevelSteps(workspace, options);
  else
    plan.steps = {{"photometric pass", kPhotometric}};
  if (options.schedule != "checkerboard" && options.geometric_iterations > 0)
    plan.steps.push_back({"geometric pass", kFinalMaps});
  if (options.schedule == "checkerboard" && options.surfaces > 0)
    plan.steps.push_back({"maps from the common surface", kFinalMaps});
  const DoneList done(workspace, StereoInputHash(workspace, options));
  for (StereoStep& step : plan.steps) step.done = done.Count(step.kind);
  return plan;
}

void EstimateDepths(const fs::path& dense, const StereoOptions& options, Progress& progress,
                    const Shard& shard) {
  const Workspace workspace = CutToObject(ChosenViews(ReadWorkspace(dense), options.views), options);
  EstimateDepths(workspace, options, StereoInputHash(workspace, options), progress, shard);
}

void EstimateDepths(const Workspace& workspace, const StereoOptions& options, std::uint64_t inputs,
                    Progress& progress, const Shard& shard) {
  if (!workspace.polarized && options.polarization)
    progress.Warn("the pictures hold no polarization: the polarization term is neglected");
  if (options.schedule == "checkerboard") return RunMultilevel(workspace, options, inputs, shard, progress);
  SequentialStage stage(workspace, options, inputs, shard, progress);
  stage.RunPass(kPhotometric, 0, options.photometric_iterations);
  if (options.geometric_iterations > 0)
    stage.RunPass(kFinalMaps, 4 * options.photometric_iterations, options.geometric_iterations);
  else
    stage.RemoveMaps(kFinalMaps);  // of an earlier run: they would go before the photometric ones
}

}  // namespace polarscan
