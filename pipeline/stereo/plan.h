// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "stereo/map_kind.h"

namespace polarscan {

// Between two steps is a barrier: a step needs the maps of the step before of all views.
struct StereoStep {
  std::string title;  // "round 1 at 1/4 size"
  MapKind kind;       // of its maps
  int done = 0;       // views whose maps of this step are there, from the same inputs and options; they are
                      // removed when the next step is done
};

struct StereoPlan {
  int views = 0;
  double pixels = 0;  // of all views, inside the masks where they count
  std::vector<StereoStep> steps;

  // The first step that is not done for all views; the number of steps if all is done.
  std::size_t Next() const {
    std::size_t next = steps.size();
    while (next > 0 && steps[next - 1].done < views) --next;
    return next;
  }
};

}  // namespace polarscan
