// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "core/image.h"
#include "core/progress.h"
#include "stereo/dense_view.h"

namespace polarscan {

// What the other masks say of a view's: where the visual hull of all of them shows, at a coarser size.
struct HullVote {
  Image<std::uint8_t> own;  // the view's mask, small: 255 = half of the pixels or more
  double scale = 1;         // px of the view to px of these
  Image<std::uint8_t>
      others;  // 255 = the rays of some of the pixels meet a place that all the other masks but a few hold
               // to be in the object
};

// One for each view; empty where it has no mask (an empty image), and for all with fewer than 16 masks. The hull is
// made of cubes, kCubes along its longest side, each one about a pixel of the coarser size; some masks (one in twenty,
// at least one) may exclude a cube that counts. A picture that does not contain a cube says nothing.
// mask: of a view, an empty image if it has none.
std::vector<HullVote> HullVotes(const std::vector<DenseView>& views,
                                const std::function<Image<std::uint8_t>(int)>& mask, Progress& progress);

}  // namespace polarscan
