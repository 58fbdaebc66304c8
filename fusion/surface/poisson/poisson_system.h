// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "core/progress.h"
#include "fusion/surface/poisson/poisson_samples.h"
#include "fusion/surface/poisson/sparse_grid.h"

namespace polarscan {

// The step of one grid of the screened Poisson reconstruction: the values x of its active nodes that minimize
//   sum over edges (i, j) of (x_j - x_i - v_ij)^2  +  8 sum over samples of weight x(sample)^2.
// v_ij is how far the function falls along the edge by the samples' normals, each spread by a cubic B-spline;
// x(sample) is trilinear; nodes that are not active stay as they are. By conjugate gradients with the
// diagonal for preconditioner, from the values that are there. At the end they are taken for the coefficients
// of quadratic B-splines, whose values at the nodes they become: a smoother surface. Same values for any
// number of threads. Throws Cancelled.
void SolvePoisson(SparseGrid& grid, const std::vector<PoissonSample>& samples, const Progress& progress);

}  // namespace polarscan
