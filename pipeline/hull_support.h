// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"
#include "fusion/cloud/cloud.h"
#include "fusion/surface/refinement/refine.h"
#include "stereo/workspace.h"

namespace polarscan {

// Few views agree on little. Where they do not, their masks and AoP still tell a shape: the visual hull of the masks
// (stereo/dense/masks/hull_surface.h), refined until its outlines are the masks' and its normals fit the AoP
// (fusion/surface/refinement/refine.h). Points of it hold a surface together that the cloud alone would leave to
// membranes.
class HullSupport {
 public:
  // Of the weight of looking alike, where the hull was needed: far apart, views look alike in wrong places, too.
  static constexpr double kPhotometric = 0.3;

  // refinement: of the surface; the hull's differs in what is sure of it.
  explicit HullSupport(const RefineOptions& refinement);

  // Adds, behind the others, the hull's points in whose place no view has points of the cloud, with confidence 0 and
  // no views; they lie less than a pixel apart. Returns false, and leaves the cloud as it is, where it covers enough of
  // the object in the views' pictures, and where masks are missing, cut off by the pictures' borders, or contradict the
  // cloud. Same points for any number of threads. Throws Cancelled.
  bool AddTo(std::vector<CloudPoint>& cloud, const Workspace& workspace, Progress& progress);

 private:
  const TriangleMesh& Hull(const SurfaceViews& views, double pixel, Progress& progress);

  RefineOptions refinement_;
  std::optional<TriangleMesh> hull_;  // of the poses below
  std::vector<Rigid> poses_;
};

}  // namespace polarscan
