// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace polarscan {

// Calls f(i) for begin <= i < end on TBB's threads (their number is the program's business:
// tbb::global_control in apps/). f must give the same result in any order. An exception thrown by f reaches
// the caller. A thread that waits for a loop inside of f takes up nothing of other loops meanwhile, so no
// more calls of f are begun than there are threads.
template <class F>
void ParallelFor(int begin, int end, F&& f) {
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(tbb::blocked_range<int>(begin, end), [&](const tbb::blocked_range<int>& r) {
      for (int i = r.begin(); i != r.end(); ++i) f(i);
    });
  });
}

}  // namespace polarscan
