// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/mesh.h"
#include "core/options.h"
#include "core/progress.h"
#include "fusion/surface/surface_views.h"

namespace polarscan {

// Weights are in units of the AoP of one view without noise. Help and ranges are in Table().
struct RefineOptions {
  bool refine = true;
  int iterations = 8;
  double anchor = 0.02;
  double smoothness = 0.5;
  double outline = 0.5;
  double photometric = 1;
  double aop_noise_deg = 5.7;
  bool polarization = true;
  bool masks = true;
};
OptionTable Table(RefineOptions& options);

// Whether the scan holds anything to refine by: polarization or masks, as far as the options use them.
bool CanRefine(const SurfaceViews& views, const RefineOptions& options);

// What was done, for scan.json.
struct RefineCounts {
  double views_per_vertex = 0;  // whose AoP said something
  double mean_move = 0;         // world units
  double outline_vertices = 0;  // share of the vertices that a mask's outline pulled
};

// Moves the vertices along their normals until the surface's normals fit the AoP of all views that see them,
// its outlines those of the masks, and it looks alike in all views. In each round every vertex gets the
// robust quadratic form of its AoP samples (diffuse or specular, whichever fits: stereo/costs/normal_from_aop.h),
// the pulls of the outlines (fusion/surface/refinement/silhouettes.h) and of its appearance
// (fusion/surface/refinement/photometric.h), where its AoP say little also a pull of its normal to that of
// its surroundings (the other two would leave ridges); then all vertices move at once
// (fusion/surface/refinement/normal_fit.h), held by where they were. The idea is that of Polarimetric MVIR
// (Zhao, Monno, Okutomi, ECCV 2020), as a sequence of linear systems; which views see a vertex is decided
// once (Embree). `far`: vertices that no points bear out, held less. Normals are computed anew. Holds two
// bytes a pixel of all views. Same result for any number of threads.
TriangleMesh RefineMesh(const TriangleMesh& mesh, const std::vector<bool>& far, const SurfaceViews& views,
                        const RefineOptions& options, RefineCounts& counts, Progress& progress);

}  // namespace polarscan
