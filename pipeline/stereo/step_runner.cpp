// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/step_runner.h"

#include "pipeline/stereo/stage_inputs.h"

namespace polarscan {

void StepRunner::Run(const std::string& title, const MapKind& kind, const Make& make) {
  const int count = int(workspace_.views.size());
  progress_.Begin(title, std::size_t(shard_.Share(count)));
  for (int view = shard_.index; view < count; view += shard_.count) {
    progress_.Check();
    if (!done_.IsDone(view, kind)) {
      WriteMaps(workspace_, view, kind, make(view));
      done_.Add(view, kind);
    }
    progress_.Advance();
  }
  done_.WaitForOthers(kind, progress_);
}

void StepRunner::RemoveOthers(const MapKind& last) {
  done_.Remove(kPhotometricMaps);
  if (last != kSeparateMaps) done_.Remove(kSeparateMaps);
  if (!alone()) return;
  RemovePassingMaps(workspace_);
  done_.KeepOnly(last);
}

}  // namespace polarscan
