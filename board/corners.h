// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <vector>

#include "board/board.h"
#include "board/markers.h"

namespace polarscan {

// An inner corner of a board in a picture; centres of pixels at integer + 0.5.
struct SeenCorner {
  int corner = 0;  // Board::Corner
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
};

// What a picture shows of boards.
struct MarkersSeen {
  std::vector<FoundMarker> markers;  // each id once: those found twice are in none
  std::vector<int> twice;            // ids
};

// The markers of S0 (any unit, linear in light; may be empty), whose brightest parts may clip. mirrored: of the picture
// seen in a mirror.
MarkersSeen SeeMarkers(const Image<float>& s0, bool mirrored = false);

// The board's corners beside markers that were found, to about 0.1 px: where the markers say that the corner is,
// then at the saddle of the picture there. A corner around which the four squares are not black and white in
// turn is left out: something hides a part of it, or a shadow ends there.
std::vector<SeenCorner> FindBoardCorners(const Image<float>& s0, const MarkersSeen& seen, const Board& board);

}  // namespace polarscan
