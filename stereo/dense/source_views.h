// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "stereo/sfm/scene_points.h"

namespace polarscan {

// How good two views are for matching by the angle between their rays to the same place: 1 at 20 degrees
// (measured best for closed objects), falling to both sides, 0 from 80 degrees and without a baseline.
double AngleScore(double angle_deg);

// For each view up to `most` others to match it with, best first. Where a view shares enough sparse points
// with others, the score is the sum of AngleScore over the shared points; else (objects without texture) it
// comes from the poses: AngleScore at the place the view looks at, times the share of its picture, at that
// depth, that the other sees. Of views from one place (SamePlace) one at most, and none from the view's own.
// Deterministic: equal scores are ordered by index.
std::vector<std::vector<int>> ChooseSourceViews(const std::vector<DenseView>& views,
                                                const std::vector<ScenePoint>& points, int most = 20);

}  // namespace polarscan
