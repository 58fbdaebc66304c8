// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <opencv2/core.hpp>
#include <vector>

namespace polarscan {

// S0, S1 and S2 of one view, in cells of several pixels.
using StokesCells = std::array<cv::Mat_<float>, 3>;

// Which cells of the views show what stands behind the object: 255. Views of one size, and as bright as one another; bright:
// S0 that is so.
//
// At first each cell's background is the light that most views agree on. What agrees with it and hangs together with the
// picture's border is background in that view; from there on, step by step: where a neighbour is background in some views,
// the cell's background is what these have in common, unless all views have it (then it may be the object's middle).
std::vector<cv::Mat_<std::uint8_t>> BackgroundCells(const std::vector<StokesCells>& views, float bright);

}  // namespace polarscan
