// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "core/image.h"
#include "core/mesh.h"
#include "core/progress.h"
#include "fusion/mesh_topology.h"
#include "fusion/surface/refinement/normal_fit.h"
#include "stereo/dense_view.h"

namespace polarscan {

// What each view sees of a surface, and with which grey values.
struct SurfaceAppearance {
  std::vector<std::vector<bool>> visible;   // [view][vertex] (fusion/surface/refinement/mesh_views.h)
  std::vector<Image<std::uint16_t>> grays;  // [view], of the whole scale
};

// Where along its normal each vertex looks most alike in all views that see it. Windows follow the surface:
// samples are the vertices around, all moved along their normals alike, at eight distances within 3.5 mean
// edges. Each view's samples are normalised over the window (mean 0, variance 1; contrast below 2 % fades);
// views count by the squared cosine between normal and line of sight, and the agreement at a distance is the
// mean product of all pairs of views, over the window. A parabola through the best distance and its two
// neighbours gives the pull's place and, by its curvature, its weight (edge^2 = 1). No pull where the
// agreement is under a tenth, or best at either end. Deterministic for any number of threads.
std::vector<Pull> PhotometricPulls(const TriangleMesh& mesh, const VertexNeighbours& neighbours,
                                   const std::vector<DenseView>& views, const SurfaceAppearance& appearance,
                                   Progress& progress);

}  // namespace polarscan
