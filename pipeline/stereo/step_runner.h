// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "pipeline/stereo/done_list.h"
#include "pipeline/stereo/shard.h"
#include "stereo/costs/stereo_view.h"
#include "stereo/options.h"
#include "stereo/workspace.h"

namespace polarscan {

// Runs the steps of stereo, one after another. A step makes one kind of maps for every view of this shard:
// views whose maps are there (from the same inputs, undamaged) are left alone, each map is written and noted
// before the next is begun, so that a run that was killed goes on where it was.
class StepRunner {
 public:
  using Make = std::function<DepthNormalMap(int view)>;

  // inputs: a hash of everything that the maps depend on.
  StepRunner(const Workspace& workspace, const StereoOptions& options, std::uint64_t inputs,
             const Shard& shard, Progress& progress)
      : workspace_(workspace),
        options_(options),
        progress_(progress),
        shard_(shard),
        done_(workspace_, inputs, shard) {}

  StepRunner(const StepRunner&) = delete;
  StepRunner& operator=(const StepRunner&) = delete;

  // A barrier: returns when the other shards have made their views' maps, too. Throws Cancelled.
  void Run(const std::string& title, const MapKind& kind, const Make& make);

  // A plan of steps, each of them in need of the maps of the step before, which are removed after it: those
  // after the last one that is done for all views. run(step) calls Run. Maps of other schedules and, unless other
  // shards work, all but the last step's go at the end.
  template <class Step, class RunStep>
  void RunFromLastDone(const std::vector<Step>& plan, RunStep&& run) {
    RunUntil(plan, run);
    RemoveOthers(plan.back().kind);
  }
  // The same of the first steps of a plan: maps that others made stay.
  template <class Step, class RunStep>
  void RunUntil(const std::vector<Step>& plan, RunStep&& run) {
    std::size_t first = plan.size();
    while (first > 0 && !done_.IsDone(plan[first - 1].kind)) --first;
    for (std::size_t i = first; i < plan.size(); ++i) {
      run(plan[i]);
      if (i > 0) done_.Remove(plan[i - 1].kind);
    }
  }

  const Workspace& workspace() const { return workspace_; }
  const StereoOptions& options() const { return options_; }
  Progress& progress() const { return progress_; }
  DoneList& done() { return done_; }
  bool alone() const { return shard_.count == 1; }

 private:
  void RemoveOthers(const MapKind& last);

  const Workspace workspace_;
  const StereoOptions options_;
  Progress& progress_;
  const Shard shard_;
  DoneList done_;
};

}  // namespace polarscan
