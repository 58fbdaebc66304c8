// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include <Eigen/Core>

#include "stereo/dense/masks/hull_votes.h"

namespace polarscan {

// A part of a picture, of a view's small size, in which its mask and the other views' masks do not agree.
struct Piece {
  bool gap = true;  // the others hold it to be in the object; false: the mask alone does
  std::vector<Eigen::Vector2i> pixels;
};

// What a view's mask and the others do not agree on.
struct Dispute {
  std::vector<Piece>
      pieces;        // connected, and thicker than what the hull usually lies outside of the mask's outline
  double slack = 0;  // what it does, px of the small size
};
Dispute DisputedPieces(const HullVote& vote);

}  // namespace polarscan
