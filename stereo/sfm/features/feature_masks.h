// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stereo/sfm/colmap/mapping.h"
#include "stereo/sfm/features/still_background.h"

namespace polarscan {

// MatchFeatures of the features that options.masks lets play a part, where views have masks (masks/NAME.png
// beside the pictures; of a view without one no feature has to be inside): "yes": those inside; "no": all;
// "auto": all, but if the background stands still (still_background.h), those that do outside of the masks
// go, and it is matched again; where there are no masks, too, if all pairs are matched ("exhaustive": neighbours alone
// may look still where a camera moves slowly). What goes is taken out of the database. Says in one line what was done and
// why. Throws Error if no feature lies inside.
void MatchMaskedFeatures(const Mapping& mapping, const std::string& matcher);

// Leaves only features inside of the masks, and no matches; false if nothing changes.
bool DropFeaturesOutsideOfMasks(const Mapping& mapping);

// How much of the database's verified matches stands still in the pictures, masks left aside.
Stillness MeasureVerifiedStillness(const Mapping& mapping);

}  // namespace polarscan
