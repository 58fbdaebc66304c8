// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/multilevel.h"
#include "stereo/dense/load_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "core/parallel.h"
#include "pipeline/stereo/done_list.h"
#include "pipeline/stereo/stage_inputs.h"
#include "stereo/costs/cost.h"
#include "stereo/dense/levels.h"
#include "stereo/rounds/round.h"
#include "stereo/rounds/surface_matching.h"
#include "stereo/search/checkerboard.h"
#include "stereo/search/filter.h"

namespace fs = std::filesystem;

namespace polarscan {
namespace {

enum class Work { kSearch, kMatching, kRound };

// One barrier stage. kind: the name of its maps, those of `before` are its input (empty: none).
struct Step {
  Work work;
  std::string kind, before, title;
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
    Step step{work,     fmt::format("step{}", steps.size()),
              "",       fmt::format("{} at {}", name, size),
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

class MultilevelStage {
 public:
  MultilevelStage(const Workspace& workspace, const StereoOptions& options, std::uint64_t input_hash,
                  const Shard& shard, Progress& progress)
      : workspace_(workspace),
        options_(options),
        shard_(shard),
        progress_(progress),
        scale_(GrayScale(workspace)),
        done_(workspace, input_hash, shard),
        steps_(PlanSteps(options, ChooseLevels(workspace, options))) {}

  void Run() {
    std::size_t first = steps_.size();  // the step after the last one that is done for all views
    while (first > 0 && !done_.IsDone(steps_[first - 1].kind)) --first;
    for (std::size_t i = first; i < steps_.size(); ++i) {
      RunStep(steps_[i]);
      done_.WaitForOthers(steps_[i].kind, progress_);
      if (i > 0) done_.Remove(steps_[i].before);
    }
    done_.Remove("photometric");  // of another schedule
    if (options_.surfaces == 0) done_.Remove(kSeparateMaps);
    if (shard_.count == 1) {
      RemoveStepsLeft();
      done_.KeepOnly(steps_.back().kind);
    }
  }

 private:
  int Count() const { return int(workspace_.views.size()); }

  // Whether these maps are the result, and to be filtered if so.
  bool IsFiltered(const Step& step) const { return options_.filter && step.kind == kFinalMaps; }

  // Of a run that was killed before it could remove them, or of one with other options.
  void RemoveStepsLeft() const {
    for (const fs::path& folder :
         {workspace_.folder / "stereo/depth_maps", workspace_.folder / "stereo/normal_maps"}) {
      std::vector<fs::path> left;
      for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.path().stem().extension().string().starts_with(".step")) left.push_back(entry.path());
      for (const fs::path& path : left) fs::remove(path);
    }
  }

  void RunStep(const Step& step) {
    const auto cache_bytes = std::size_t(options_.cache_gb * 1e9);
    Cache<StereoView>& views = ViewsAt(step.halvings);
    Cache<DepthNormalMap> maps(
        cache_bytes / 2, [&](int v) { return MapsBefore(step, v); },
        [](const DepthNormalMap& m) { return BytesOf(m); });
    progress_.Begin(step.title, std::size_t(shard_.Share(Count())));
    for (int view = shard_.index; view < Count(); view += shard_.count) {
      progress_.Check();
      if (!done_.IsDone(view, step.kind)) {
        const DepthNormalMap map = Run(step, view, views, maps);
        WriteMaps(workspace_, view, step.kind, map);
        done_.Add(view, step.kind);
      }
      progress_.Advance();
    }
  }

  // The views at a size, kept from step to step.
  Cache<StereoView>& ViewsAt(int halvings) {
    if (!views_ || views_halvings_ != halvings)
      views_.emplace(
          std::size_t(options_.cache_gb * 1e9) / 2,
          [this, halvings](int v) { return LoadStereoView(workspace_, v, scale_, options_, halvings); },
          [](const StereoView& v) { return BytesOf(v); });
    views_halvings_ = halvings;
    return *views_;
  }

  // The maps of the step before, at this step's size.
  DepthNormalMap MapsBefore(const Step& step, int view) const {
    DepthNormalMap map = ReadMaps(workspace_, view, step.before);
    if (step.halvings == step.halvings_before) return map;
    Pinhole camera = workspace_.views[std::size_t(view)].camera;
    for (int i = 0; i < step.halvings; ++i) camera = HalfCamera(camera);
    return Enlarged(map, camera);
  }

  // A map for pictures of twice the size: each pixel lies on the plane of the one that covers it.
  static DepthNormalMap Enlarged(const DepthNormalMap& half, const Pinhole& camera) {
    const Pinhole half_camera = HalfCamera(camera);
    DepthNormalMap map{Image<float>(camera.width, camera.height),
                       Image<Eigen::Vector3f>(camera.width, camera.height, Eigen::Vector3f::Zero())};
    ParallelFor(0, camera.height, [&](int y) {
      for (int x = 0; x < camera.width; ++x) {
        const int hx = std::min(x / 2, half_camera.width - 1), hy = std::min(y / 2, half_camera.height - 1);
        const Hypothesis estimate{half.depth(hx, hy), half.normal(hx, hy)};
        if (estimate.depth <= 0) continue;
        const float depth = DepthOnPlane(estimate, half_camera.Ray(hx + 0.5, hy + 0.5).cast<float>(),
                                         camera.Ray(x + 0.5, y + 0.5).cast<float>());
        map.depth(x, y) = std::clamp(depth, 0.95f * estimate.depth, 1.05f * estimate.depth);
        map.normal(x, y) = estimate.normal;
      }
    });
    return map;
  }

  DepthNormalMap Run(const Step& step, int view, Cache<StereoView>& views, Cache<DepthNormalMap>& maps) {
    switch (step.work) {
      case Work::kSearch:
        return Search(step, view, views, maps);
      case Work::kMatching:
        return Matching(step, view, views, maps);
      case Work::kRound:
        break;
    }
    return Round(step, view, views, maps);
  }

  DepthNormalMap Search(const Step& step, int view, Cache<StereoView>& views, Cache<DepthNormalMap>& maps) {
    const bool warm = !step.before.empty();
    const auto reference = views.Get(view);
    const Problem problem =
        MakeProblem(workspace_, view, options_, *reference, views, warm ? &maps : nullptr);
    const Image<DepthInterval> hull =
        VisualHull(problem, warm ? std::vector<Source>{}
                                 : SourcesWithSilhouettes(workspace_, view, options_, *reference, views));
    DepthNormalMap map;
    if (warm) map = *maps.Get(view);
    const CheckerboardPass pass{warm ? options_.geometric_iterations : options_.photometric_iterations, warm,
                                100 * step.index};
    RunCheckerboard(problem, options_, hull, pass, map, progress_);
    if (IsFiltered(step)) FilterEstimates(problem, options_, {}, map);
    return map;
  }

  DepthNormalMap Matching(const Step& step, int view, Cache<StereoView>& views, Cache<DepthNormalMap>& maps) {
    const auto reference = views.Get(view);
    const Problem problem = MakeProblem(workspace_, view, options_, *reference, views, &maps);
    const auto own = maps.Get(view);
    SurfaceMatchingOptions matching;
    matching.chosen_sources = options_.matching_sources;
    matching.window_px = float(options_.matching_window_px);
    matching.smoothing_px = float(options_.matching_smoothing_px);
    matching.epsilon = float(options_.ncc_epsilon);
    DepthNormalMap map{MatchSurface(problem, *own, matching), own->normal};
    if (IsFiltered(step)) FilterEstimates(problem, options_, {}, map);
    return map;
  }

  DepthNormalMap Round(const Step& step, int view, Cache<StereoView>& views, Cache<DepthNormalMap>& maps) {
    const auto reference = views.Get(view);
    const Problem problem = VotersProblem(workspace_, view, options_, *reference, views, maps);
    const auto own = maps.Get(view);
    RoundResult result = RunRound(problem, *own, options_, step.sharpness);
    if (IsFiltered(step)) FilterBySupport(problem, options_, result.confidence, result.map);
    return std::move(result.map);
  }

  const Workspace& workspace_;
  const StereoOptions& options_;
  const Shard shard_;
  Progress& progress_;
  const float scale_;
  DoneList done_;
  const std::vector<Step> steps_;
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

void RunMultilevel(const Workspace& workspace, const StereoOptions& options, std::uint64_t input_hash,
                   const Shard& shard, Progress& progress) {
  MultilevelStage(workspace, options, input_hash, shard, progress).Run();
}

}  // namespace polarscan
