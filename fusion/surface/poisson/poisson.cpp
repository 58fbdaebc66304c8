// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/poisson/poisson.h"

#include <fmt/format.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <deque>

#include "core/error.h"
#include "core/parallel.h"
#include "fusion/surface/poisson/marching_cubes.h"
#include "fusion/surface/poisson/poisson_samples.h"
#include "fusion/surface/poisson/poisson_system.h"
#include "fusion/surface/poisson/sparse_grid.h"

namespace polarscan {
namespace {

constexpr double kCube = 1.1;  // the reconstruction's cube, as a multiple of the cloud's longest side
constexpr int kFinest = 12;
constexpr std::size_t kPointsPerCell = 2;
using Sample = PoissonSample;
constexpr int kBand = 3;  // nodes around points and the coarser grid's surface that are active
constexpr int kMostGb = 8;
constexpr std::size_t kMostBlocks = kMostGb * 1'000'000'000ull / 1600;  // of a grid

Eigen::AlignedBox3f Box(std::span<const CloudPoint> cloud) {
  Eigen::AlignedBox3f box;
  for (const CloudPoint& p : cloud) box.extend(p.position);
  return box;
}

template <class F>
void ForBlocksNear(const Eigen::Vector3i& from, const Eigen::Vector3i& to, int side, F&& f) {
  const auto block = [side](int node) { return std::clamp(node, 0, side - 1) / SparseGrid::kSide; };
  for (int z = block(from.z()); z <= block(to.z()); ++z)
    for (int y = block(from.y()); y <= block(to.y()); ++y)
      for (int x = block(from.x()); x <= block(to.x()); ++x) f(SparseGrid::Key({x, y, z}));
}

std::vector<std::uint64_t> BlocksNear(const std::vector<Sample>& samples, int side) {
  std::vector<std::uint64_t> blocks;
  for (const Sample& sample : samples) {
    const Eigen::Vector3i cell = sample.at.cast<int>();
    ForBlocksNear(cell.array() - kBand + 1, cell.array() + kBand, side,
                  [&](std::uint64_t key) { blocks.push_back(key); });
  }
  return blocks;
}

std::vector<std::uint64_t> AllBlocks(int side) {
  std::vector<std::uint64_t> blocks;
  ForBlocksNear(Eigen::Vector3i::Zero(), Eigen::Vector3i::Constant(side - 1), side,
                [&](std::uint64_t key) { blocks.push_back(key); });
  return blocks;
}

// Blocks of the next finer grid.
void AddBlocksNearSurface(const SparseGrid& grid, float level, std::vector<std::uint64_t>& blocks) {
  for (int block = 0; block < grid.size(); ++block) {
    std::vector<std::uint64_t> near;
    SparseGrid::Halo halo;
    grid.Load(block, halo);
    const SparseGrid::Place place = SparseGrid::PlaceOf(grid.key(block));
    for (int node = 0; node < SparseGrid::kNodes; ++node) {
      const SparseGrid::Place local = SparseGrid::LocalPlace(node);
      const auto above = [&](int x, int y, int z) {
        return halo[std::size_t(SparseGrid::HaloIndex(local[0] + x, local[1] + y, local[2] + z))] > level;
      };
      const bool here = above(0, 0, 0);
      if (above(1, 0, 0) == here && above(0, 1, 0) == here && above(0, 0, 1) == here) continue;
      const Eigen::Vector3i fine = 2 * Eigen::Vector3i(SparseGrid::PlaceOfNode(place, node).data());
      ForBlocksNear(fine.array() - kBand + 1, fine.array() + 2 + kBand, 2 * grid.side(),
                    [&](std::uint64_t key) { near.push_back(key); });
    }
    std::ranges::sort(near);
    near.erase(std::ranges::unique(near).begin(), near.end());
    blocks.insert(blocks.end(), near.begin(), near.end());
  }
}

// Ascending, each once. Throws Error if the grid would need too much memory.
std::vector<std::uint64_t> Distinct(std::vector<std::uint64_t> blocks, int depth) {
  tbb::parallel_sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  if (blocks.size() > kMostBlocks)
    throw Error("the surface needs too much memory",
                fmt::format("more than {} GB at octree depth {}", kMostGb, depth),
                "Choose a smaller --mesh-depth");
  return blocks;
}

// Of the grid's values at the samples.
float Level(const SparseGrid& grid, const std::vector<Sample>& samples) {
  std::vector<float> values(samples.size());
  ParallelFor(0, int(samples.size()), [&](int i) {
    const Sample& sample = samples[std::size_t(i)];
    values[std::size_t(i)] = sample.area * grid.Interpolated(sample.at.x(), sample.at.y(), sample.at.z());
  });
  double sum = 0, area = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) sum += values[i], area += samples[i].area;
  return float(sum / area);
}

}  // namespace

double PoissonCell(std::span<const CloudPoint> cloud, int depth) {
  return kCube * double(Box(cloud).sizes().maxCoeff()) / std::pow(2.0, depth);
}

std::size_t OccupiedCells(std::span<const CloudPoint> cloud, int depth) {
  const double cell = PoissonCell(cloud, depth);
  const Eigen::Vector3f corner = Box(cloud).min();
  std::vector<std::uint64_t> cells;
  cells.reserve(cloud.size());
  for (const CloudPoint& p : cloud) {
    const Eigen::Vector3d at = (p.position - corner).cast<double>() / cell;
    cells.push_back(SparseGrid::Key({int(at.x()), int(at.y()), int(at.z())}));
  }
  tbb::parallel_sort(cells.begin(), cells.end());
  return std::size_t(std::unique(cells.begin(), cells.end()) - cells.begin());
}

int PoissonDepth(std::span<const CloudPoint> cloud) {
  for (int depth = kFinest; depth > kCoarsestDepth; --depth)
    if (kPointsPerCell * OccupiedCells(cloud, depth) <= cloud.size()) return depth;
  return kCoarsestDepth;
}

TriangleMesh PoissonSurface(std::span<const CloudPoint> cloud, int depth, Progress& progress) {
  const double cell = PoissonCell(cloud, depth);
  if (!(cell > 0)) throw NothingFound("all points lie at one place", fmt::format("{} points", cloud.size()));
  const Eigen::Vector3d origin =
      Box(cloud).center().cast<double>() - Eigen::Vector3d::Constant(cell * std::pow(2.0, depth) / 2);
  std::vector<std::vector<Sample>> samples{FinestSamples(cloud, origin, cell)};  // finest first
  Distinct(BlocksNear(samples.back(), 1 << depth), depth);  // too much is said before the work, not after it
  for (int coarser = depth; coarser > kCoarsestDepth; --coarser) samples.push_back(Coarser(samples.back()));
  progress.Begin("surface from the cloud", samples.size(), "grid");
  std::deque<SparseGrid> grids;
  float level = 0;
  for (int at = kCoarsestDepth; at <= depth; ++at, samples.pop_back()) {
    std::vector<std::uint64_t> blocks =
        grids.empty() ? AllBlocks(1 << at) : BlocksNear(samples.back(), 1 << at);
    if (!grids.empty()) AddBlocksNearSurface(grids.back(), level, blocks);
    grids.emplace_back(at, Distinct(std::move(blocks), at), grids.empty() ? nullptr : &grids.back());
    SolvePoisson(grids.back(), samples.back(), progress);
    level = Level(grids.back(), samples.back());
    progress.Advance();
  }
  TriangleMesh mesh = MarchingCubes(grids.back(), level);
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex = origin + cell * vertex;
  return mesh;
}

}  // namespace polarscan
