// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/poisson/sparse_grid.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace polarscan {

SparseGrid::SparseGrid(int depth, std::vector<std::uint64_t> blocks, const SparseGrid* coarser)
    : depth_(depth), keys_(std::move(blocks)), coarser_(coarser) {
  around_.resize(keys_.size());
  values_.resize(keys_.size() * kNodes);
  ParallelFor(0, size(), [&](int block) {
    const auto [x, y, z] = PlaceOf(key(block));
    for (int i = 0; i < 27; ++i)
      around_[std::size_t(block)][std::size_t(i)] = Find({x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1});
  });
  if (!coarser_) return;
  ParallelFor(0, size(), [&](int block) {
    for (int i = 0; i < kNodes; ++i) {
      const auto [x, y, z] = PlaceOfNode(PlaceOf(key(block)), i);
      Values(block)[i] = coarser_->Interpolated(0.5f * float(x), 0.5f * float(y), 0.5f * float(z));
    }
  });
}

int SparseGrid::Find(const Place& place) const {
  for (int coordinate : place)
    if (coordinate < 0 || coordinate >= side() / kSide) return kOutside;
  const auto found = std::lower_bound(keys_.begin(), keys_.end(), Key(place));
  return found != keys_.end() && *found == Key(place) ? int(found - keys_.begin()) : kInactive;
}

float SparseGrid::At(int x, int y, int z) const {
  x = std::clamp(x, 0, side() - 1), y = std::clamp(y, 0, side() - 1), z = std::clamp(z, 0, side() - 1);
  const int block = Find({x / kSide, y / kSide, z / kSide});
  if (block >= 0) return Values(block)[LocalIndex(x % kSide, y % kSide, z % kSide)];
  return coarser_ ? coarser_->Interpolated(0.5f * float(x), 0.5f * float(y), 0.5f * float(z)) : 0;
}

float SparseGrid::Interpolated(float x, float y, float z) const {
  const int ix = int(std::floor(x)), iy = int(std::floor(y)), iz = int(std::floor(z));
  const float fx = x - float(ix), fy = y - float(iy), fz = z - float(iz);
  float sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
    const float weight = (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy) * (dz ? fz : 1 - fz);
    if (weight > 0) sum += weight * At(ix + dx, iy + dy, iz + dz);
  }
  return sum;
}

void SparseGrid::Load(int block, Halo& halo) const {
  Load(values_, block, halo);
  const auto [x, y, z] = PlaceOf(key(block));
  const auto& around = Around(block);
  for (int i = 0; i < 27; ++i) {
    if (around[std::size_t(i)] >= 0) continue;
    const auto range = [](int step) {
      return step == 0 ? std::array{-1, 0} : step == 1 ? std::array{0, kSide} : std::array{kSide, kSide + 1};
    };
    const auto rx = range(i % 3), ry = range(i / 3 % 3), rz = range(i / 9);
    for (int lz = rz[0]; lz < rz[1]; ++lz)
      for (int ly = ry[0]; ly < ry[1]; ++ly)
        for (int lx = rx[0]; lx < rx[1]; ++lx)
          halo[std::size_t(HaloIndex(lx, ly, lz))] = At(kSide * x + lx, kSide * y + ly, kSide * z + lz);
  }
}

void SparseGrid::Load(const std::vector<float>& values, int block, Halo& halo) const {
  const auto& around = Around(block);
  // Per coordinate from -1 to 4: the step to the block that holds it, and its place there. Beyond the cube
  // the nearest node counts.
  const auto Outside = [&](int step, int stride) {
    return around[std::size_t(13 + step * stride)] == kOutside;
  };
  struct Split {
    int step, local;
  };
  std::array<std::array<Split, kHaloSide>, 3> splits;
  for (int axis = 0, stride = 1; axis < 3; ++axis, stride *= 3)
    for (int i = -1; i <= kSide; ++i) {
      const int step = i < 0 ? -1 : i == kSide ? 1 : 0;
      splits[std::size_t(axis)][std::size_t(i + 1)] =
          Outside(step, stride) ? Split{0, i < 0 ? 0 : kSide - 1} : Split{step, i - step * kSide};
    }
  float* out = halo.data();
  for (const Split& sz : splits[2])
    for (const Split& sy : splits[1])
      for (const Split& sx : splits[0]) {
        const int from = around[std::size_t(13 + sx.step + 3 * sy.step + 9 * sz.step)];
        *out++ =
            from < 0
                ? 0
                : values[std::size_t(from) * kNodes + std::size_t(LocalIndex(sx.local, sy.local, sz.local))];
      }
}

}  // namespace polarscan
