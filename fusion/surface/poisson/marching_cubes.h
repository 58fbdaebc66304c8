// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/mesh.h"
#include "fusion/surface/poisson/sparse_grid.h"

namespace polarscan {

// The surface where the grid's values are `level`, around the larger ones, by marching cubes (Lorensen,
// Cline, SIGGRAPH 1987) through the cells of the active blocks; closed where it does not leave them or the
// cube: on a face whose corners alternate the larger values are kept apart, by both cells. In steps of the
// grid, without normals. Same bytes for any number of threads.
TriangleMesh MarchingCubes(const SparseGrid& grid, float level);

}  // namespace polarscan
