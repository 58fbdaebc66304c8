// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "demosaic/polar_view.h"

namespace polarscan {

// Pictures of one view for people, into `folder`, which is made anew (demosaic/false_colour.h says what each
// shows):
//   s0.png diffuse.png specular.png   grey, s0_full is white
//   dop.png                           heat, 0 to 0.5 and above
//   aop.png aop_dop.png aop_even.png  angle alone; with the degree as brightness, 0.5 and above is full; the
//                                     same in evenly spaced colours. The wheel in the corner shows direction
//                                     by colour
//   redundancy.png                    heat, 0 to 5 times its noise; only where the source has four angles
void WriteViewPictures(const std::filesystem::path& folder, const PolarView& view, double s0_full);

}  // namespace polarscan
