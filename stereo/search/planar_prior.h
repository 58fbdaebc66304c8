// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stereo/search/acmh.h"

namespace polarscan {

// Planes between points that are certain (ACMP: Xu and Tao, AAAI 2020): the cheapest pixel of each 5x5 block, if
// it costs less than 0.1, is a vertex of a Delaunay triangulation, each triangle a plane. Depth 0 where there is
// no triangle, or where its plane leaves the depth range.
DepthNormalMap PlanarPrior(const Problem& problem, const CostedMap& estimates);

}  // namespace polarscan
