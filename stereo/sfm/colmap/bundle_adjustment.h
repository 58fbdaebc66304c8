// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stereo/sfm/colmap/mapping.h"

namespace polarscan {

// Known poses that are only nearly right (a turntable's, a robot's), made to fit the pictures: points are
// triangulated and poses and points adjusted together by COLMAP's bundle_adjuster (Triggs et al., 1999),
// twice, the second time with points that fit the better poses. Cameras' lenses stay as they are. The result
// is moved to where its camera centres fit the known ones best (AlignCameras; not if they lie on one
// line), so it stays in the known poses' frame and scale. Says how far the cameras moved. The known poses,
// with a warning, if COLMAP makes no points for all views.
SparseModel AdjustKnownPoses(const Mapping& mapping, const SparseModel& known);

}  // namespace polarscan
