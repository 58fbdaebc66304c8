// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/image.h"
#include "stereo/costs/problem.h"
#include "stereo/options.h"

namespace polarscan {

// A round across views, the barrier stage after a search: the view's map is confronted with those of the
// other views (vote.h), its normals are solved from the AoP of all of them (normals.h), and its depth is
// integrated from those normals (integrate.h), the last two in turns. `problem`: its sources, with maps, are
// all views that vote, more than those of the search. sharpness: 1, later rounds less: width of the vote's
// kernel. Without polarization the normals stay, without the depth-normal term nothing is integrated.
struct RoundResult {
  DepthNormalMap map;
  Image<float> confidence;  // support of the voted depth
};
RoundResult RunRound(const Problem& problem, const DepthNormalMap& own, const StereoOptions& options,
                     float sharpness);

}  // namespace polarscan
