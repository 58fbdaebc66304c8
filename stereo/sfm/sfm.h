// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "core/options.h"
#include "core/progress.h"
#include "stereo/sfm/model/model.h"

namespace polarscan {

struct SfmOptions {
  // One focal length and one radial term by default: on a scene that is mostly a table, models with two focal
  // lengths (PINHOLE, OPENCV) settle in wrong ones.
  std::string camera_model = "SIMPLE_RADIAL";
  bool single_camera = true;
  double focal_px = 0;
  std::string matcher = "auto";
  int max_features = 8192;
  int max_image_size = 1600;
  double min_registered = 0.4;
  std::string masks = "auto";
  std::string board = "auto", poses_from = "auto";
  double board_square_mm = 0;
  bool triangulate = false;
  bool bundle_adjustment = false;
  int seed = 0;
  std::string colmap = "colmap";
  int threads = 0;  // 0: as many as TBB may use; not in the table, results do not depend on it
};
OptionTable Table(SfmOptions& options);

// Cameras and poses of the views (stereo/sfm/view_list.h) in `views`, from COLMAP, or from `known_model` (a
// folder with a COLMAP model whose image names match by stem; options.bundle_adjustment: made to fit the
// pictures, adjust_poses.h). Image names of the result are NAME.png; views that did not register are
// missing from it; its coordinates are local where the known ones lie far from 0 (offset). Everything is kept
// below `sfm_folder`: colmap.log, database, models/, and the result in model/; a result that was made from
// the same pictures and options is taken as it is. What part masks play is options.masks (feature_masks.h).
// A board in the views (board/board_scale.h) gives the result its millimetres and its frame; known poses keep
// theirs unless options.board asks.
// Throws Error with a plain sentence on causes and cures if too few views register; warns if some do not.
SparseModel EstimatePoses(const std::filesystem::path& views, const std::filesystem::path& sfm_folder,
                          const std::optional<std::filesystem::path>& known_model, const SfmOptions& options,
                          Progress& progress);

}  // namespace polarscan
