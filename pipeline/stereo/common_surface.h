// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"
#include "fusion/surface/refinement/refine.h"
#include "pipeline/hull_support.h"
#include "pipeline/meshing.h"
#include "stereo/costs/stereo_view.h"
#include "stereo/options.h"
#include "stereo/workspace.h"

namespace polarscan {

// One surface that all views agree on, to be seen from any of them.
struct CommonSurface {
  RayCaster caster;
  std::vector<bool> far;  // vertices that no points bear out: of membranes over holes
};

// What refines the surface, as the options of stereo say.
RefineOptions RefinementBy(const StereoOptions& options);

// The maps of that kind of all views are fused into a cloud; the cloud becomes one surface, about as fine as
// the pictures, that the AoP of all views and the masks' outlines refine (pipeline/meshing.h); hull: supports it where
// views agree on nothing. goes_on: as of MakeSurface. Throws NothingFound if the maps make none: too few points, or too
// large a scene.
CommonSurface MakeCommonSurface(const Workspace& workspace, const MapKind& maps, const StereoOptions& options,
                                HullSupport& hull, const GoesOn& goes_on, Progress& progress);

// The view's map with the surface in it: where it has a depth and the surface is hit, depth and normal are
// the surface's. In views without masks not where the surface is a membrane and the two depths differ.
DepthNormalMap Drawn(const CommonSurface& surface, const DenseView& view, bool masked,
                     const DepthNormalMap& own);

}  // namespace polarscan
