// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "fusion/cloud/maps.h"

namespace polarscan {

// The views (indices into workspace.views, by place, then rising) that may see what `reference` sees: those
// into whose picture most of a sample of its points falls, seen from the front, at most `limit` of them,
// `reference` itself and views not in `usable` left out. places: of all views (stereo/workspace.h); a
// second view of a place comes after all first ones.
std::vector<int> OverlappingViews(const Workspace& workspace, int reference, const ViewMaps& maps,
                                  const std::vector<bool>& usable, const std::vector<int>& places, int limit);

// All views in an order in which one follows near another: from the first one always to the nearest camera
// that is left. Consecutive views then ask for nearly the same others.
std::vector<int> WalkingOrder(const Workspace& workspace);

}  // namespace polarscan
