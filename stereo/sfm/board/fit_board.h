// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/camera.h"
#include "core/similarity.h"
#include "stereo/sfm/model/camera_models.h"

namespace polarscan {

struct BoardCamera {
  Lens lens;
  Rigid cam_from_world;
};

// A point of the board (its frame, mm) as a camera shows it (px, centres of pixels at integer + 0.5).
struct BoardObservation {
  int camera = 0, point = 0;  // the latter: a name, the same for the same point
  Eigen::Vector3d on_board = Eigen::Vector3d::Zero();
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
};

struct BoardFit {
  Similarity board_from_world;  // its scale: mm a unit of the world
  double scale_sigma = 0;       // of that, relative, 1 sigma
  double rms_px = 0;            // of the observations that count
  double inliers = 0;           // share of the observations within the limit
};

// The similarity that takes the cameras' world to the board, by the observations' misses in the pictures.
// Start: each point from pairs of views, then three points at a time, by how many observations fit to
// `limit_px`. Then least squares of all misses under Cauchy's loss, in Ceres. scale_sigma is the greater one
// of two: by the misses' own spread, as if they were independent (curvature), and by how the views differ
// from each other (sandwich, each view a cluster: errors of its pose move all its corners alike; Liang, Zeger,
// Biometrika 1986). None if no three points can be had from the views.
std::optional<BoardFit> FitBoard(const std::vector<BoardCamera>& cameras,
                                 const std::vector<BoardObservation>& observations, double limit_px);

}  // namespace polarscan
