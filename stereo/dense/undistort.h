// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "core/options.h"
#include "core/progress.h"
#include "stereo/dense/masks/finding/find_masks.h"
#include "stereo/dense/masks/mend_masks.h"
#include "stereo/sfm/model/camera_models.h"

namespace polarscan {

struct UndistortOptions {
  int max_image_size = 0;
  bool masks = true;
  bool find_masks = true;
  bool mend_masks = true;
  double depth_min = 0, depth_max = 0;
};
OptionTable Table(UndistortOptions& options);

// What was done about a workspace's masks.
struct MaskNotes {
  FoundMasks found;
  MaskMending mending;
};

// Makes the dense workspace (stereo/workspace.h) from the views (NAME.tif, NAME.png, masks/NAME.png)
// that `model` holds a pose for, but for copies (LeaveOutCopies): lens distortion is removed from Stokes
// components, pictures and masks, and the size is reduced if wanted; sources and depth ranges are chosen;
// COLMAP's files are written. Views without distortion and at full size are copied bit for bit. A stereo/
// folder with maps is left alone; everything else that was in `dense` is replaced, and views.json comes last.
// Masks are looked for if there are none (masks/find_masks.h), and mended (masks/mend_masks.h).
// Throws Error if a view's files are missing, damaged or of another size than the model's camera.
MaskNotes Undistort(const std::filesystem::path& views, const SparseModel& model,
                    const std::filesystem::path& dense, const UndistortOptions& options, Progress& progress);

}  // namespace polarscan
