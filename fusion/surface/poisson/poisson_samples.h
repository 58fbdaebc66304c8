// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/cloud/cloud.h"

namespace polarscan {

// All points of a cell of one of the grids of fusion/surface/poisson/poisson.h as one. Lengths are steps of
// the grid.
struct PoissonSample {
  std::uint64_t block;  // that holds the cell's first node: a key of SparseGrid
  Eigen::Vector3f at;
  Eigen::Vector3f normal;  // outward; its length is the area, less where the points' normals differ
  float area;
  float weight;  // area times the number of points, as a multiple of the mean number
};

// Of the finest grid, whose first node lies at `origin`, in the order of their blocks. A sample's area is
// what the samples around it leave to it.
std::vector<PoissonSample> FinestSamples(std::span<const CloudPoint> cloud, const Eigen::Vector3d& origin,
                                         double cell);
// The same on the next coarser grid.
std::vector<PoissonSample> Coarser(std::vector<PoissonSample> samples);

// Those of one block.
std::span<const PoissonSample> SamplesOf(const std::vector<PoissonSample>& samples, std::uint64_t block);

}  // namespace polarscan
