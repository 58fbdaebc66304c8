// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"

namespace polarscan {

// Moves the vertices marked `free` until each is the mean of its neighbours (a harmonic surface with uniform
// weights) over the rim of those that stay, to a millionth of the mesh's mean edge. Conjugate gradients with
// a multigrid of aggregates as preconditioner (Vanek, Mandel, Brezina 1996, without smoothing the
// interpolation): time and memory grow with the number of vertices, whatever their neighbourhoods look like.
// A piece of which no vertex stays shrinks to a point.
void StretchMembranes(TriangleMesh& mesh, const std::vector<bool>& free, Progress& progress);

}  // namespace polarscan
