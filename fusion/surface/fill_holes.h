// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"

namespace polarscan {

struct HoleOptions {
  double largest_hole = 0.2;     // filled; as a share of the area of the surface that there are points for
  double smallest_piece = 0.01;  // kept; as a share of the largest one's area
};

// What became of the parts of a surface that no points bear out.
struct HoleCounts {
  int filled = 0, open = 0;  // holes
  int pieces = 0;            // thrown away
  double filled_area = 0;    // share of the whole surface's area
};

// Makes an honest surface of one that goes on where nothing was seen. `far`: vertices without points nearby.
// Each connected far part becomes the membrane over its rim (harmonic with uniform weights: every vertex the
// mean of its neighbours), instead of the balloon that a Poisson surface makes there; a membrane larger than
// the largest hole is cut out. Holes of the surface itself are filled the same way, and pieces that are small
// or wholly far go. On return `far` marks the vertices of the new mesh that lie inside of a membrane. Normals
// are computed anew.
TriangleMesh FillHoles(const TriangleMesh& mesh, std::vector<bool>& far, const HoleOptions& options,
                       HoleCounts& counts, Progress& progress);

}  // namespace polarscan
