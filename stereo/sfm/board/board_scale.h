// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/progress.h"
#include "core/similarity.h"
#include "stereo/sfm/board/length_unit.h"
#include "stereo/sfm/board/sightings.h"
#include "stereo/sfm/model/model.h"

namespace polarscan {

enum class BoardUse {
  kTell,   // the model stays, and what its unit is is said
  kTake,   // it is moved, turned and scaled
  kAdjust  // and made to fit the board's corners (adjust_with_board.h)
};

// Takes a model to the frame and the millimetres of the board that its views show, and says how well that is
// known. Where the board does not fit the poses (it moved against what they were taken from) a warning says
// so, and the model stays.
LengthUnit TakeUnitOfBoard(SparseModel& model, const BoardSightings& sightings, BoardUse use,
                           Progress& progress);

// Moves, turns and scales poses and points; what the offset was counted from is lost, so it becomes 0.
void Transform(SparseModel& model, const Similarity& target_from_world);

}  // namespace polarscan
