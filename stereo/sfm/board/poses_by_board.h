// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "core/progress.h"
#include "stereo/sfm/board/sightings.h"
#include "stereo/sfm/model/model.h"
#include "stereo/sfm/sfm.h"
#include "stereo/sfm/view_list.h"

namespace polarscan {

// Lens and poses by the board's corners alone, in its frame and millimetres: a plane's homographies (Zhang, PAMI 2000;
// OpenCV), then AdjustWithBoard. Of views that show eight corners or more, all by one camera (options.single_camera,
// camera_model, focal_px); the corners are the model's points. None if fewer than three views do, the pictures differ in
// size, or the board is of no use.
std::optional<SparseModel> PosesByBoard(const std::vector<ListedView>& views, const BoardSightings& sightings,
                                        const SfmOptions& options, const Progress& progress);

// Corners of the board in the view that shows the fewest; 0: there is none.
std::size_t FewestCorners(const BoardSightings& sightings);

}  // namespace polarscan
