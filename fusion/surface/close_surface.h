// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"

namespace polarscan {

struct ClosingOptions {
  double largest_gap = 0.2;      // closed; as a share of the area of the surface that there are points for
  double smallest_piece = 0.01;  // kept; as a share of the largest one's area
};

// What became of the parts of a surface that no points bear out.
struct ClosingCounts {
  int closed = 0, cut = 0;  // gaps
  int pieces = 0;           // thrown away
  double closed_area = 0;   // share of the whole surface's area
};

// Makes an honest surface of one that goes on where nothing was seen. `far`: vertices without points nearby.
// Each connected far part becomes the membrane over its rim (harmonic with uniform weights: every vertex the
// mean of its neighbours), instead of the balloon that a Poisson surface makes there; a membrane larger than
// the largest gap is cut out. Holes of the surface itself are filled the same way, and pieces that are small
// or wholly far go. On return `far` marks the vertices of the new mesh that lie inside of a membrane. Normals
// are computed anew.
TriangleMesh CloseSurface(const TriangleMesh& mesh, std::vector<bool>& far, const ClosingOptions& options,
                          ClosingCounts& counts, Progress& progress);

}  // namespace polarscan
