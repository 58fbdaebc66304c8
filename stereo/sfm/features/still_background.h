// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <string>
#include <vector>

#include "stereo/sfm/colmap/database.h"

namespace polarscan {

// Features by picture, true for some of them.
using FeatureFlags = std::map<std::string, std::vector<bool>>;

// How many pairs of pictures show that something stands still in the picture while the object turns: the room
// behind a turntable, a label on the lens. A pair tells if it has at least 15 matches outside of the masks
// (both ends; everywhere without masks); it stands still if at least half of these (a fifth without masks: some are the
// object's) stay within 0.2 % of the picture's longer side (1.5 px at least). Pairs whose matches inside of the masks stand still, too, were
// taken from one place and do not tell.
struct Stillness {
  int pairs = 0, still = 0;
  FeatureFlags features;  // outside of the masks: more of their matches stand still than move

  // Half of the pairs, three at least. Where the camera goes round the object next to none do.
  bool IsBackground() const { return still >= 3 && 2 * still >= pairs; }
};

// inside: features in the masks; {}: there are no masks. longest_side: of the pictures, px.
Stillness MeasureStillness(const FeaturePlaces& places, const std::vector<PictureMatches>& matches,
                           const FeatureFlags& inside, int longest_side);

}  // namespace polarscan
