// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>

#include "acquisition/host/host.h"
#include "core/progress.h"

namespace polarscan {

// Checks that belong together, and how long they may take. `run` may throw: that becomes a bad check.
struct HostTask {
  std::string name;
  double limit_s = 5;
  std::string fix;  // what to do when it throws or does not end
  std::function<std::vector<HostCheck>(Progress&)> run;
};

// Runs all of them at the same time; the checks come in the order of the tasks. One that does not end in time
// (a network disk, a driver that hangs) is cancelled, has a second to tidy up, is then left alone, and is
// reported. Throws Cancelled within that second when asked to stop.
std::vector<HostCheck> RunHostTasks(const std::vector<HostTask>& tasks, const Progress& progress);

}  // namespace polarscan
