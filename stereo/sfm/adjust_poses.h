// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/progress.h"
#include "stereo/sfm/model/model.h"

namespace polarscan {

// What an adjustment found out.
struct AdjustmentFigures {
  double observation_px = 0;            // standard deviation of observations, on one axis
  double rotation_rad = 0, centre = 0;  // and of the given rotations and centres (world units), on one axis
  double moved_rms = 0, moved_max = 0;  // distance of the camera centres from the given ones, world units
  int dropped = 0;                      // observations that miss their point, or are the only one of theirs
};

// Bundle adjustment (Triggs et al., 1999) with priors, for poses that are known with errors: poses and
// points of `model` are made to fit its observations and the `given` poses (images of the same names)
// together. Rotations, centres and observations miss by errors that are normal but for exceptions (Cauchy's
// cost: a wrong match, or one pose that is far off, does not pull the others). How large these errors
// usually are is found by turns with the poses: so given poses that are better than the pictures stay,
// worse ones move, and the given ones alone say where the world lies and how large it is. Lenses stay as
// they are. Levenberg-Marquardt (Ceres) on one thread: the same bytes each time. Observations that miss by
// more than limit_px in the end go. Throws Error for a lens that is not supported, Cancelled.
AdjustmentFigures AdjustPoses(SparseModel& model, const SparseModel& given, double limit_px,
                              const Progress& progress);

}  // namespace polarscan
