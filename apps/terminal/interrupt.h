// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/progress.h"

namespace polarscan {

// From now on the first Ctrl-C (or SIGTERM) asks `progress` to stop, and the second one kills. What has not
// stopped by itself four fifths of a second after the first one (a library's call that nobody can interrupt)
// is ended with exit code 1: everything on disk survives a kill at any moment (docs/trust.md).
class StopOnInterrupt {
 public:
  explicit StopOnInterrupt(Progress& progress);
  ~StopOnInterrupt();  // all is done: a late Ctrl-C changes nothing any more
  StopOnInterrupt(const StopOnInterrupt&) = delete;
  StopOnInterrupt& operator=(const StopOnInterrupt&) = delete;
};

// Not so for what must end in its own time: a camera's frames that were taken and are not stored yet, files
// that are of no use alone.
void EndInItsOwnTime();

}  // namespace polarscan
