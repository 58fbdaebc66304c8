// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"

namespace polarscan {

// Moves the vertices marked `free` until each is the mean of its neighbours (a harmonic surface with uniform
// weights) over the rim of those that stay, to a hundred-thousandth of the mesh's mean edge. Conjugate
// gradients with a multigrid of aggregates as preconditioner (Braess, Computing 55, 1995): time and memory
// grow with the number of vertices, whatever their neighbourhoods look like; the same bytes for any number of
// threads. A piece of which no vertex stays shrinks to a point.
void StretchMembranes(TriangleMesh& mesh, const std::vector<bool>& free, Progress& progress);

}  // namespace polarscan
