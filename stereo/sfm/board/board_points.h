// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <optional>
#include <vector>

#include "stereo/sfm/board/fit_board.h"

namespace polarscan {

// A point of the board in the world, by its name.
struct BoardPoint {
  Eigen::Vector3d on_board, in_world;
};

// Where the camera shows a point of the world; none behind it.
std::optional<Eigen::Vector2d> Shown(const BoardCamera& camera, const Eigen::Vector3d& world);

// Each point from the pair of its views that most of its observations agree with to `limit_px`, then from all
// that agree. Points that no two views agree on are missing.
std::map<int, BoardPoint> TriangulateBoard(const std::vector<BoardCamera>& cameras,
                                           const std::vector<BoardObservation>& observations,
                                           double limit_px);

}  // namespace polarscan
