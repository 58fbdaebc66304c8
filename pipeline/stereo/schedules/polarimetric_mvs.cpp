// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/schedules/polarimetric_mvs.h"

#include "pipeline/stereo/stage_inputs.h"
#include "stereo/contours/propagate.h"
#include "stereo/dense/load_view.h"
#include "stereo/search/acmh.h"
#include "stereo/search/filter.h"

namespace polarscan {
namespace {

constexpr MapKind kSearched{MapStage::kStep, 0}, kReliable{MapStage::kStep, 1};

// Of the searches: by intensity alone, and only texture is a reason to trust a point.
StereoOptions PhotometricOptions(StereoOptions options) {
  options.polarization = false;
  return options;
}

// Of the filter: every source may agree, as no probabilities of seeing the point are known.
StereoOptions WithoutVisibility(StereoOptions options) {
  options.filter_min_ncc = 0;
  return options;
}

class PolarimetricMvs {
 public:
  explicit PolarimetricMvs(StepRunner& steps)
      : steps_(steps),
        scale_(GrayScale(steps.workspace())),
        photometric_(PhotometricOptions(steps.options())),
        agreeing_(WithoutVisibility(photometric_)) {}

  void Run(const StereoStep& step) {
    if (step.kind == kSearched) return Search(step);
    if (step.kind == kReliable) return FindReliable(step);
    Propagate(step);
  }

 private:
  const Workspace& workspace() const { return steps_.workspace(); }
  const Progress& progress() const { return steps_.progress(); }

  void Search(const StereoStep& step) {
    Cache<StereoView> views = CachedViews(workspace(), photometric_, scale_);
    steps_.Run(step.title, step.kind, [&](int view) {
      const auto reference = views.Get(view);
      const Problem problem = MakeProblem(workspace(), view, photometric_, *reference, views, nullptr);
      CostedMap state = StartAcmh(problem, photometric_, {}, progress());
      RunAcmh(problem, photometric_, {photometric_.photometric_iterations, 0, nullptr}, state, progress());
      return std::move(state.map);
    });
  }

  // The points that texture, a good match (filter_min_ncc) and enough other views speak for.
  void FindReliable(const StereoStep& step) {
    Cache<StereoView> views = CachedViews(workspace(), photometric_, scale_);
    Cache<DepthNormalMap> maps =
        CachedMaps(photometric_, [&](int view) { return ReadMaps(workspace(), view, kSearched); });
    steps_.Run(step.title, step.kind, [&](int view) {
      const auto reference = views.Get(view);
      const Problem problem = MakeProblem(workspace(), view, photometric_, *reference, views, &maps);
      CostedMap state = StartAcmh(problem, photometric_, *maps.Get(view), progress());
      RunAcmh(problem, photometric_, {photometric_.geometric_iterations, 1000, nullptr}, state, progress());
      const float most = float(1 - photometric_.filter_min_ncc);
      for (std::size_t i = 0; i < state.cost.size(); ++i)
        if (state.cost.pixels()[i] > most) state.map.depth.pixels()[i] = 0;  // its normal helps the labels
      FilterEstimates(problem, agreeing_, {}, state.map);
      return std::move(state.map);
    });
  }

  void Propagate(const StereoStep& step) {
    steps_.Run(step.title, step.kind, [&](int view) {
      const StereoView reference = LoadStereoView(workspace(), view, scale_, steps_.options());
      const DenseView& dense = workspace().views[std::size_t(view)];
      const Problem problem{&reference, {}, float(dense.depth_min), float(dense.depth_max), view};
      Propagated made = PropagateDepth(problem, ReadMaps(workspace(), view, kReliable), {}, progress());
      if (steps_.options().filter) DropUnreached(made);
      return std::move(made.map);
    });
  }

  static void DropUnreached(Propagated& made) {
    for (std::size_t i = 0; i < made.reached.size(); ++i) {
      if (made.reached.pixels()[i]) continue;
      made.map.depth.pixels()[i] = 0;
      made.map.normal.pixels()[i].setZero();
    }
  }

  StepRunner& steps_;
  const float scale_;
  const StereoOptions photometric_, agreeing_;
};

}  // namespace

std::vector<StereoStep> PolarimetricMvsSteps() {
  return {{"photometric pass", kSearched},
          {"points that views agree on", kReliable},
          {"propagation along contours", kFinalMaps}};
}

void RunPolarimetricMvs(StepRunner& steps) {
  PolarimetricMvs method(steps);
  steps.RunFromLastDone(PolarimetricMvsSteps(), [&](const StereoStep& step) { method.Run(step); });
}

}  // namespace polarscan
