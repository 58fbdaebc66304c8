// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>

#include "core/mesh.h"
#include "core/progress.h"
#include "fusion/cloud/cloud.h"

namespace polarscan {

constexpr int kCoarsestDepth = 5;  // of the grid that covers the whole cube

// The octree depth at which the surface's cells still hold two points each on average: finer cells would be
// filled from their neighbours. The cube around the cloud has 2^depth cells along each side. 5 to 12.
int PoissonDepth(std::span<const CloudPoint> cloud);
// How many of them hold a point.
std::size_t OccupiedCells(std::span<const CloudPoint> cloud, int depth);
// Width of a cell at that depth, world units.
double PoissonCell(std::span<const CloudPoint> cloud, int depth);

// Screened Poisson reconstruction (Kazhdan, Hoppe, TOG 2013), on grids from coarse to fine, each only near
// the points and the surface of the one before: the surface of a function that falls along the points'
// normals and is constant at the points. It goes on where there are no points, and is closed but where it
// meets the cube. No vertex normals. Same bytes for any number of threads. Throws Cancelled, and Error if the
// grids would not fit in memory.
TriangleMesh PoissonSurface(std::span<const CloudPoint> cloud, int depth, Progress& progress);

}  // namespace polarscan
