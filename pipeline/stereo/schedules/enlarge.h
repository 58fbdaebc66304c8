// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stereo/costs/stereo_view.h"

namespace polarscan {

// A map for pictures of twice the size (`camera`): each pixel lies on the plane of the one that covers it.
DepthNormalMap Enlarged(const DepthNormalMap& half, const Pinhole& camera);

// The same by joint bilateral upsampling (Kopf et al., SIGGRAPH 2007), as ACMM does it: each pixel takes the mean of
// the planes of the 3x3 pixels around the one that covers it, weighted by distance and by how like their grey
// is to its own. gray, half_gray: of both sizes.
DepthNormalMap EnlargedByGray(const DepthNormalMap& half, const Pinhole& camera, const Image<float>& gray,
                              const Image<float>& half_gray);

}  // namespace polarscan
