// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/mesh.h"
#include "core/options.h"
#include "core/progress.h"
#include "fusion/surface/inverse_rendering/shading.h"
#include "fusion/surface/surface_views.h"

namespace polarscan {

// Weights of the terms of Polarimetric MVIR, intensities in units of their mean. Help and ranges are in
// Table().
struct MvirOptions {
  int rounds = 5;
  int steps = 5;
  double photometric = 0.1;
  double polarimetric = 1;
  double smoothness = 0.3;
  double albedo_smoothness = 0.1;
  double anchor = 0.001;
  double dop_saturation = 1;
};
OptionTable Table(MvirOptions& options);

// What was done, for scan.json. Costs: half of the function, by vertex; in the first and the last round.
struct MvirCounts {
  double views_per_vertex = 0;
  double mean_move = 0;  // world units
  double cost_before = 0, cost_after = 0;
};

// The mesh moved, the albedo of each of its vertices (mean 1 over those that are seen) and the light of each
// view (zero where a view sees nothing), in units of the mean intensity of what was seen at first.
struct RenderedSurface {
  TriangleMesh mesh;
  std::vector<double> albedo;
  std::vector<Harmonics> lights;
};

// A rival of our own refinement (fusion/surface/refinement/refine.h): Polarimetric Multi-View Inverse
// Rendering (Zhao, Monno, Okutomi, ECCV 2020 and TPAMI 2022), by Ceres. Finds moves of the vertices, their
// albedos K and each view's light L that minimise
//   photometric  sum_vertices mean_views (K S(n, L) - I)^2       intensity against its rendering
// + polarimetric sum_vertices mean_views g(DoP) delta(n, AoP)^2  azimuth against the four of the AoP
//                (both: fusion/surface/inverse_rendering/vertex_cost.h)
// + smoothness        sum_facets (angle to its neighbours' mean / pi)^2.2
// + albedo_smoothness sum_edges rho((K_i - K_j)^2)
// + anchor            sum_vertices (distance from where it was / mean edge)^2     (these: .../smoothness.h)
// In each round: which vertices are visible where (Embree) and what the pictures show there; lights in closed
// form (.../shading.h); a few Levenberg-Marquardt steps over moves along the normals (of a mean edge at most)
// and albedos together. Without `polarized` it is Multi-View Inverse Rendering (Kim, Torii, Okutomi, ECCV
// 2016). Where it differs from the papers: docs/rivals.md. Normals are computed anew. Ceres works
// on one thread, as its sums depend on their number: same result for any number of threads. Reads every view
// once a round. Throws Error if no view sees anything, Cancelled (within one step of the solver).
RenderedSurface RenderInversely(const TriangleMesh& mesh, const SurfaceViews& views, bool polarized,
                                const MvirOptions& options, MvirCounts& counts, Progress& progress);

}  // namespace polarscan
