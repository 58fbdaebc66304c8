// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/progress.h"
#include "stereo/sfm/board/sightings.h"
#include "stereo/sfm/model/model.h"

namespace polarscan {

// What an adjustment found: standard deviations of corners and of features, px, on one axis; and of the focal lengths,
// relative, the largest of all cameras', by the corners alone.
struct BoardAdjustment {
  double corner_px = 0, feature_px = 0, focal_sigma = 0;
};

// Bundle adjustment (Triggs et al., 1999) of a model that is in the board's frame: poses, points, and of the lenses
// what their models leave free but the principal point, are made to fit the features and the board's corners, which are
// known points. Both miss by errors that are normal but for exceptions (Cauchy's cost), each kind by its own
// deviation, found by turns with the rest. The corners say where the world lies and how large it is.
// Levenberg-Marquardt (Ceres) on one thread: the same bytes each time. Views that the board does not show are held by their
// features. Throws Error for a lens that is not supported, Cancelled.
BoardAdjustment AdjustWithBoard(SparseModel& model, const BoardSightings& sightings,
                                const Progress& progress);

}  // namespace polarscan
