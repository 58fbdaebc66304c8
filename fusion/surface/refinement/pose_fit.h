// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"
#include "fusion/surface/surface_views.h"

namespace polarscan {

// A view's pose that fits a surface, beside the one that it had.
struct PoseFit {
  Rigid cam_from_world;
  double moved_px =
      0;  // root mean square of how far the surface's vertices that the view sees move in its picture
  bool fitted = false;  // false: too little was seen to tell, and the pose is as it was
};

// Fits each view's pose to a surface that all views made together, so that one view's error hardly shows in it:
// - the surface's outline lies on its mask's (OutlinePulls), where the view has a mask and `masks` says so;
// - each vertex looks as it does in the other views: grey values less those of their surroundings, as a share of these,
//   which neither exposure nor smooth shading change.
// Both are robust (Cauchy, scaled by the median residual); Gauss-Newton over rotation and translation, from outlines far
// away to near ones. Six values a view cannot be told where neither is seen enough. Same result for any number of
// threads.
std::vector<PoseFit> FitPoses(const TriangleMesh& mesh, const SurfaceViews& views, bool masks,
                              Progress& progress);

}  // namespace polarscan
