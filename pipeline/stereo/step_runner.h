// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>

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

  const Workspace& workspace() const { return workspace_; }
  const StereoOptions& options() const { return options_; }
  Progress& progress() const { return progress_; }
  DoneList& done() { return done_; }
  bool alone() const { return shard_.count == 1; }

 private:
  const Workspace workspace_;
  const StereoOptions options_;
  Progress& progress_;
  const Shard shard_;
  DoneList done_;
};

}  // namespace polarscan
