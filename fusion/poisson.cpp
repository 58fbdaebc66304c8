// SPDX-License-Identifier: Apache-2.0
#include "fusion/poisson.h"

#include <fmt/format.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <deque>

#include "core/error.h"
#include "core/parallel.h"
#include "fusion/marching_cubes.h"
#include "fusion/sparse_grid.h"

namespace polarscan {
namespace {

constexpr double kCube = 1.1;  // the reconstruction's cube, as a multiple of the cloud's longest side
constexpr int kFinest = 12;
constexpr std::size_t kPointsPerCell = 2;
constexpr int kSide = SparseGrid::kSide, kNodes = SparseGrid::kNodes;
constexpr int kBand = 3;  // nodes around points and the coarser grid's surface that are active
constexpr int kMostGb = 8;
constexpr std::size_t kMostBlocks = kMostGb * 1'000'000'000ull / 1600;  // of a grid
constexpr float kScreening = 8;
constexpr int kMostSteps = 60;
constexpr double kResidual = 1e-2;  // of the linear system, as a share of its right side

Eigen::AlignedBox3f Box(std::span<const CloudPoint> cloud) {
  Eigen::AlignedBox3f box;
  for (const CloudPoint& p : cloud) box.extend(p.position);
  return box;
}

// All points of one cell as one. Lengths are steps of the grid.
struct Sample {
  std::uint64_t block;  // that holds the cell's first node
  Eigen::Vector3f at;
  Eigen::Vector3f normal;  // outward; its length is the area, less where the points' normals differ
  float area;
};

std::uint64_t BlockOf(const Eigen::Vector3f& at) {
  return SparseGrid::Key({int(at.x()) / kSide, int(at.y()) / kSide, int(at.z()) / kSide});
}

int CellInBlock(const Eigen::Vector3f& at) {
  return SparseGrid::LocalIndex(int(at.x()) % kSide, int(at.y()) % kSide, int(at.z()) % kSide);
}

// One sample for each cell that holds some of `samples`, in the order of blocks: their mean, the sums of
// areas and normals.
std::vector<Sample> OneForEachCell(std::vector<Sample> samples) {
  struct Key {
    std::uint64_t block;
    int cell;
    std::uint32_t index;
    auto operator<=>(const Key&) const = default;
  };
  std::vector<Key> order(samples.size());
  ParallelFor(0, int(samples.size()), [&](int i) {
    const Eigen::Vector3f& at = samples[std::size_t(i)].at;
    order[std::size_t(i)] = {BlockOf(at), CellInBlock(at), std::uint32_t(i)};
  });
  tbb::parallel_sort(order.begin(), order.end());
  std::vector<Sample> merged;
  for (std::size_t i = 0, end; i < order.size(); i = end) {
    Sample sum{order[i].block, Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero(), 0};
    for (end = i;
         end < order.size() && order[end].block == order[i].block && order[end].cell == order[i].cell;
         ++end) {
      const Sample& sample = samples[order[end].index];
      sum.at += sample.area * sample.at, sum.normal += sample.normal, sum.area += sample.area;
    }
    sum.at /= sum.area;
    merged.push_back(sum);
  }
  return merged;
}

// Samples by block.
class SamplesOf {
 public:
  explicit SamplesOf(const std::vector<Sample>& samples) : samples_(samples) {}
  std::span<const Sample> operator()(std::uint64_t block) const {
    const auto range = std::ranges::equal_range(samples_, block, {}, &Sample::block);
    return {range.begin(), range.end()};
  }

 private:
  const std::vector<Sample>& samples_;
};

template <class F>
void ForBlocksNear(const Eigen::Vector3i& from, const Eigen::Vector3i& to, int side, F&& f) {
  const auto block = [side](int node) { return std::clamp(node, 0, side - 1) / kSide; };
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
    SparseGrid::Halo halo;
    grid.Load(block, halo);
    const SparseGrid::Place place = SparseGrid::PlaceOf(grid.key(block));
    for (int node = 0; node < kNodes; ++node) {
      const Eigen::Vector3i local(node % kSide, node / kSide % kSide, node / (kSide * kSide));
      const auto above = [&](int x, int y, int z) {
        return halo[std::size_t(SparseGrid::HaloIndex(local.x() + x, local.y() + y, local.z() + z))] > level;
      };
      const bool here = above(0, 0, 0);
      if (above(1, 0, 0) == here && above(0, 1, 0) == here && above(0, 0, 1) == here) continue;
      const Eigen::Vector3i fine = 2 * (kSide * Eigen::Vector3i(place[0], place[1], place[2]) + local);
      ForBlocksNear(fine.array() - kBand + 1, fine.array() + 2 + kBand, 2 * grid.side(),
                    [&](std::uint64_t key) { blocks.push_back(key); });
    }
  }
}

// The cubic B-spline, and how it falls from one node to the next: B(t + 1/2) - B(t - 1/2).
float Spline(float t) {
  t = std::abs(t);
  if (t < 1) return 2.f / 3 - t * t * (1 - t / 2);
  return t < 2 ? (2 - t) * (2 - t) * (2 - t) / 6 : 0;
}

float SplineStep(float t) { return Spline(t + 0.5f) - Spline(t - 0.5f); }

// Where a sample lies among the values of a block with those around: its cell's first node there, and the
// weights of the cell's corners.
struct Touch {
  int first;
  std::array<float, 8> weights;
  float screening;
};

constexpr int CornerStep(int corner) {
  return (corner & 1) + SparseGrid::kHaloSide * ((corner >> 1 & 1) + SparseGrid::kHaloSide * (corner >> 2));
}

// The linear system of one grid: minimizes the sum over edges of (x_j - x_i - v)^2, where v is what the
// samples' normals, spread by the spline, say of that edge, and of kScreening area x(sample)^2 over samples;
// nodes that are not active stay as they are. Solved by conjugate gradients with the diagonal for
// preconditioner, from the values that are there. Sums go block by block: same bytes for any number of
// threads.
class GridSystem {
 public:
  GridSystem(SparseGrid& grid, const std::vector<Sample>& samples)
      : grid_(grid), touches_(std::size_t(grid.size())), residual_(Size()), inverse_diagonal_(Size()) {
    const SamplesOf samples_of(samples);
    std::vector<double> right_side(std::size_t(grid.size()));
    ParallelFor(0, grid.size(),
                [&](int block) { right_side[std::size_t(block)] = Prepare(block, samples_of); });
    right_side_ = Sum(right_side);
  }

  void Solve(const Progress& progress) {
    std::vector<float> change(Size()), direction(Size()), image(Size());
    std::vector<double> part(std::size_t(grid_.size()));
    double size = ForBlocks(part, [&](std::size_t i) {
      direction[i] = inverse_diagonal_[i] * residual_[i];
      return double(direction[i]) * residual_[i];
    });
    const double enough = kResidual * kResidual * right_side_;
    for (int iteration = 0; iteration < kMostSteps && size > enough; ++iteration) {
      progress.Check();
      ParallelFor(0, grid_.size(),
                  [&](int block) { part[std::size_t(block)] = Apply(block, direction, image); });
      const auto step = float(size / Sum(part));
      const double before = size;
      size = ForBlocks(part, [&](std::size_t i) {
        change[i] += step * direction[i];
        residual_[i] -= step * image[i];
        return double(residual_[i]) * inverse_diagonal_[i] * residual_[i];
      });
      const auto share = float(size / before);
      ForBlocks(part, [&](std::size_t i) {
        direction[i] = inverse_diagonal_[i] * residual_[i] + share * direction[i];
        return 0.0;
      });
    }
    ForBlocks(part, [&](std::size_t i) {
      grid_.Values(0)[i] += change[i];
      return 0.0;
    });
  }

 private:
  std::size_t Size() const { return std::size_t(grid_.size()) * kNodes; }

  static double Sum(const std::vector<double>& part) {
    double sum = 0;
    for (double value : part) sum += value;
    return sum;
  }

  template <class F>
  double ForBlocks(std::vector<double>& part, F&& f) {
    ParallelFor(0, grid_.size(), [&](int block) {
      double sum = 0;
      for (std::size_t i = std::size_t(block) * kNodes; i < std::size_t(block + 1) * kNodes; ++i) sum += f(i);
      part[std::size_t(block)] = sum;
    });
    return Sum(part);
  }

  // What the system makes of the values of a block with those around.
  void Image(int block, const SparseGrid::Halo& x, float* image) const {
    std::array<float, std::tuple_size_v<SparseGrid::Halo>> screening{};
    for (const Touch& touch : touches_[std::size_t(block)]) {
      float value = 0;
      for (int corner = 0; corner < 8; ++corner)
        value += touch.weights[std::size_t(corner)] * x[std::size_t(touch.first + CornerStep(corner))];
      value *= touch.screening;
      for (int corner = 0; corner < 8; ++corner)
        screening[std::size_t(touch.first + CornerStep(corner))] +=
            touch.weights[std::size_t(corner)] * value;
    }
    for (int node = 0, z = 0; z < kSide; ++z)
      for (int y = 0; y < kSide; ++y)
        for (int i = SparseGrid::HaloIndex(0, y, z); i < SparseGrid::HaloIndex(kSide, y, z); ++i, ++node) {
          const auto at = [&x, i](int step) { return x[std::size_t(i + step)]; };
          image[node] = 6 * at(0) - (at(-1) + at(1)) - (at(-kRow) + at(kRow)) - (at(-kLayer) + at(kLayer)) +
                        screening[std::size_t(i)];
        }
  }

  // The product of the values and their image.
  double Apply(int block, const std::vector<float>& values, std::vector<float>& image) const {
    SparseGrid::Halo x;
    grid_.Load(values, block, x);
    const std::size_t begin = std::size_t(block) * kNodes;
    Image(block, x, image.data() + begin);
    double product = 0;
    for (std::size_t i = begin; i < begin + kNodes; ++i) product += double(values[i]) * image[i];
    return product;
  }

  // Returns the size of the right side.
  double Prepare(int block, const SamplesOf& samples_of) {
    const SparseGrid::Place place = SparseGrid::PlaceOf(grid_.key(block));
    const Eigen::Vector3i first = kSide * Eigen::Vector3i(place[0], place[1], place[2]);
    std::vector<Touch>& touches = touches_[std::size_t(block)];
    std::array<float, kNodes> right{}, diagonal;
    diagonal.fill(6);
    for (int around : grid_.Around(block)) {
      if (around < 0) continue;
      for (const Sample& sample : samples_of(grid_.key(around))) {
        const Eigen::Vector3f at = sample.at - first.cast<float>();
        AddNormal(at, sample.normal, right);
        const Eigen::Vector3i cell(int(std::floor(at.x())), int(std::floor(at.y())), int(std::floor(at.z())));
        if (cell.minCoeff() < -1 || cell.maxCoeff() >= kSide) continue;
        touches.push_back(TouchOf(at - cell.cast<float>(), cell, kScreening * sample.area));
      }
    }
    for (const Touch& touch : touches)
      for (int corner = 0; corner < 8; ++corner) {
        const int x = touch.first % kRow + (corner & 1) - 1,
                  y = touch.first / kRow % kRow + (corner >> 1 & 1) - 1,
                  z = touch.first / kLayer + (corner >> 2) - 1;
        const float weight = touch.weights[std::size_t(corner)];
        if (std::min({x, y, z}) >= 0 && std::max({x, y, z}) < kSide)
          diagonal[std::size_t(SparseGrid::LocalIndex(x, y, z))] += touch.screening * weight * weight;
      }
    SparseGrid::Halo x;
    grid_.Load(block, x);
    std::array<float, kNodes> image;
    Image(block, x, image.data());
    const std::size_t begin = std::size_t(block) * kNodes;
    double right_side = 0;
    for (std::size_t i = 0; i < kNodes; ++i) {
      residual_[begin + i] = right[i] - image[i];
      inverse_diagonal_[begin + i] = 1 / diagonal[i];
      right_side += double(right[i]) * right[i] / diagonal[i];
    }
    return right_side;
  }

  // Inside is where normals come from: values fall along them.
  static void AddNormal(const Eigen::Vector3f& at, const Eigen::Vector3f& normal,
                        std::array<float, kNodes>& right) {
    std::array<std::array<float, kSide>, 3> weight, step;
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < kSide; ++i) {
        weight[std::size_t(axis)][std::size_t(i)] = Spline(float(i) - at[axis]);
        step[std::size_t(axis)][std::size_t(i)] = normal[axis] * SplineStep(float(i) - at[axis]);
      }
    const auto& [wx, wy, wz] = weight;
    const auto& [sx, sy, sz] = step;
    for (std::size_t z = 0, node = 0; z < kSide; ++z)
      for (std::size_t y = 0; y < kSide; ++y)
        for (std::size_t x = 0; x < kSide; ++x, ++node)
          right[node] += sx[x] * wy[y] * wz[z] + wx[x] * (sy[y] * wz[z] + wy[y] * sz[z]);
  }

  static Touch TouchOf(const Eigen::Vector3f& f, const Eigen::Vector3i& cell, float screening) {
    Touch touch{SparseGrid::HaloIndex(cell.x(), cell.y(), cell.z()), {}, screening};
    for (int corner = 0; corner < 8; ++corner)
      touch.weights[std::size_t(corner)] = ((corner & 1) ? f.x() : 1 - f.x()) *
                                           ((corner & 2) ? f.y() : 1 - f.y()) *
                                           ((corner & 4) ? f.z() : 1 - f.z());
    return touch;
  }

  static constexpr int kRow = SparseGrid::kHaloSide, kLayer = kRow * kRow;
  SparseGrid& grid_;
  std::vector<std::vector<Touch>> touches_;  // of each block
  std::vector<float> residual_, inverse_diagonal_;
  double right_side_;  // its square, in the preconditioner's measure
};

// The area for which each sample stands, in steps of the grid, by the number of samples around, which count
// less with each coordinate's distance, to nothing at a block's width. In a plane along the axes they add up
// to width^2 times their density, in oblique ones to a little less.
void SetAreas(std::vector<Sample>& samples) {
  const SamplesOf samples_of(samples);
  std::vector<float> areas(samples.size());
  std::vector<std::size_t> begins;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (i == 0 || samples[i].block != samples[i - 1].block) begins.push_back(i);
  ParallelFor(0, int(begins.size()), [&](int group) {
    const std::size_t begin = begins[std::size_t(group)];
    const std::span<const Sample> own = samples_of(samples[begin].block);
    std::vector<float> counts(own.size());
    const SparseGrid::Place place = SparseGrid::PlaceOf(samples[begin].block);
    for (int i = 0; i < 27; ++i) {
      const SparseGrid::Place other{place[0] + i % 3 - 1, place[1] + i / 3 % 3 - 1, place[2] + i / 9 - 1};
      if (std::ranges::min(other) < 0) continue;
      for (const Sample& sample : samples_of(SparseGrid::Key(other)))
        for (std::size_t k = 0; k < own.size(); ++k) {
          const Eigen::Array3f apart = (sample.at - own[k].at).array().abs() / float(kSide);
          counts[k] += (1 - apart).max(0.f).prod();
        }
    }
    for (std::size_t k = 0; k < own.size(); ++k) areas[begin + k] = float(kSide * kSide) / counts[k];
  });
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i].normal *= areas[i] / samples[i].area;
    samples[i].area = areas[i];
  }
}

std::vector<Sample> FinestSamples(std::span<const CloudPoint> cloud, const Eigen::Vector3d& origin,
                                  double cell) {
  std::vector<Sample> samples(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i)
    samples[i] = {0, ((cloud[i].position.cast<double>() - origin) / cell).cast<float>(), cloud[i].normal, 1};
  samples = OneForEachCell(std::move(samples));
  SetAreas(samples);
  return samples;
}

// The same on the next coarser grid.
std::vector<Sample> Coarser(std::vector<Sample> samples) {
  for (Sample& sample : samples) sample.at /= 2, sample.normal /= 4, sample.area /= 4;
  return OneForEachCell(std::move(samples));
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
    cells.push_back(std::uint64_t(at.x()) << 42 | std::uint64_t(at.y()) << 21 | std::uint64_t(at.z()));
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
    GridSystem(grids.back(), samples.back()).Solve(progress);
    level = Level(grids.back(), samples.back());
    progress.Advance();
  }
  TriangleMesh mesh = MarchingCubes(grids.back(), level);
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex = origin + cell * vertex;
  return mesh;
}

}  // namespace polarscan
