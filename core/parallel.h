// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include "core/error.h"

namespace polarscan {

// Calls f(i) for begin <= i < end on TBB's threads (their number is the program's business:
// tbb::global_control in apps/). f must give the same result in any order. An exception thrown by f reaches
// the caller. A thread that waits for a loop inside of f takes up nothing of other loops meanwhile, so no
// more calls of f are begun than there are threads. Where a loop around this one has failed elsewhere, TBB
// leaves out the rest of this one: then it throws Cancelled, so that nobody goes on with half of its work
// (the caller gets the error of the other place).
template <class F>
void ParallelFor(int begin, int end, F&& f) {
  tbb::task_group_context context;
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(
        tbb::blocked_range<int>(begin, end),
        [&](const tbb::blocked_range<int>& r) {
          for (int i = r.begin(); i != r.end(); ++i) f(i);
        },
        context);
  });
  if (context.is_group_execution_cancelled()) throw Cancelled();
}

}  // namespace polarscan
