// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/poisson/poisson_samples.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <compare>

#include "core/parallel.h"
#include "fusion/surface/poisson/sparse_grid.h"

namespace polarscan {
namespace {

using Sample = PoissonSample;

std::uint64_t BlockOf(const Eigen::Vector3f& at) {
  return SparseGrid::Key(
      {int(at.x()) / SparseGrid::kSide, int(at.y()) / SparseGrid::kSide, int(at.z()) / SparseGrid::kSide});
}

int CellInBlock(const Eigen::Vector3f& at) {
  return SparseGrid::LocalIndex(int(at.x()) % SparseGrid::kSide, int(at.y()) % SparseGrid::kSide,
                                int(at.z()) % SparseGrid::kSide);
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
    Sample sum{order[i].block, Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero(), 0, 0};
    for (end = i;
         end < order.size() && order[end].block == order[i].block && order[end].cell == order[i].cell;
         ++end) {
      const Sample& sample = samples[order[end].index];
      sum.at += sample.area * sample.at, sum.normal += sample.normal, sum.area += sample.area;
      sum.weight += sample.weight;
    }
    sum.at /= sum.area;
    merged.push_back(sum);
  }
  return merged;
}

// The area for which each sample stands, in steps of the grid, by the number of samples around, which count
// less with each coordinate's distance, to nothing at a block's width. In a plane along the axes they add up
// to width^2 times their density, in oblique ones to a little less.
void SetAreas(std::vector<Sample>& samples) {
  std::vector<float> areas(samples.size());
  std::vector<std::size_t> begins;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (i == 0 || samples[i].block != samples[i - 1].block) begins.push_back(i);
  ParallelFor(0, int(begins.size()), [&](int group) {
    const std::size_t begin = begins[std::size_t(group)];
    const std::span<const Sample> own = SamplesOf(samples, samples[begin].block);
    std::vector<float> counts(own.size());
    const SparseGrid::Place place = SparseGrid::PlaceOf(samples[begin].block);
    for (int i = 0; i < 27; ++i) {
      const SparseGrid::Place other{place[0] + i % 3 - 1, place[1] + i / 3 % 3 - 1, place[2] + i / 9 - 1};
      if (std::ranges::min(other) < 0) continue;
      for (const Sample& sample : SamplesOf(samples, SparseGrid::Key(other)))
        for (std::size_t k = 0; k < own.size(); ++k) {
          const Eigen::Array3f apart = (sample.at - own[k].at).array().abs() / float(SparseGrid::kSide);
          counts[k] += (1 - apart).max(0.f).prod();
        }
    }
    for (std::size_t k = 0; k < own.size(); ++k)
      areas[begin + k] = float(SparseGrid::kSide * SparseGrid::kSide) / counts[k];
  });
  double sum = 0;
  for (const Sample& sample : samples) sum += sample.weight;
  const auto mean = float(sum / double(samples.size()));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i].normal *= areas[i] / samples[i].area;
    samples[i].area = areas[i];
    samples[i].weight *= areas[i] / mean;
  }
}

}  // namespace

std::span<const Sample> SamplesOf(const std::vector<Sample>& samples, std::uint64_t block) {
  const auto range = std::ranges::equal_range(samples, block, {}, &Sample::block);
  return {range.begin(), range.end()};
}

std::vector<Sample> FinestSamples(std::span<const CloudPoint> cloud, const Eigen::Vector3d& origin,
                                  double cell) {
  std::vector<Sample> samples(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i)
    samples[i] = {0, ((cloud[i].position.cast<double>() - origin) / cell).cast<float>(), cloud[i].normal, 1,
                  1};
  samples = OneForEachCell(std::move(samples));
  SetAreas(samples);
  return samples;
}

std::vector<Sample> Coarser(std::vector<Sample> samples) {
  for (Sample& sample : samples) sample.at /= 2, sample.normal /= 4, sample.area /= 4, sample.weight /= 4;
  return OneForEachCell(std::move(samples));
}

}  // namespace polarscan
