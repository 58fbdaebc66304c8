// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <span>
#include <string>

#include "core/mesh.h"
#include "core/progress.h"
#include "fusion/cloud.h"

namespace polarscan {

constexpr int kCoarsestDepth = 5;  // at 4 COLMAP 3.8 makes dents of 0.6 cells in a sphere

// The octree depth at which the surface's cells still hold two points each on average: finer cells would be
// filled from their neighbours. The cube around the cloud has 2^depth cells along each side. 5 to 12.
int PoissonDepth(std::span<const CloudPoint> cloud);
// How many of them hold a point.
std::size_t OccupiedCells(std::span<const CloudPoint> cloud, int depth);
// Width of a cell at that depth, world units.
double PoissonCell(std::span<const CloudPoint> cloud, int depth);

// Screened Poisson reconstruction (Kazhdan, Hoppe, TOG 2013) by COLMAP's poisson_mesher, run as a program on
// one thread: with more it gives other bytes each time (and 3.8 takes longer). A surface around everything,
// also where there are no points; closed but where it meets the cube, and where COLMAP made no numbers. No
// vertex normals. Works in `folder`, which keeps COLMAP's log. Throws Error if COLMAP is missing or makes no
// surface.
TriangleMesh PoissonSurface(std::span<const CloudPoint> cloud, int depth, const std::string& colmap,
                            const std::filesystem::path& folder, Progress& progress);

}  // namespace polarscan
