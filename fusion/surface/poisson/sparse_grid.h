// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <vector>

namespace polarscan {

// Values at the nodes of a cube of 2^depth nodes a side, kept where they are needed, in blocks of 4x4x4
// nodes; elsewhere those of the next coarser grid, of which every node lies on a node (i, j, k) of this one,
// at (2i, 2j, 2k). Coordinates are in steps of this grid.
class SparseGrid {
 public:
  static constexpr int kSide = 4, kNodes = kSide * kSide * kSide;
  static constexpr int kInactive = -1, kOutside = -2;
  using Place = std::array<int, 3>;  // of a node; of a block: its first node is (4x, 4y, 4z)
  // A block's values with those around, from -1 to 4 along each axis, x fastest.
  static constexpr int kHaloSide = kSide + 2;
  using Halo = std::array<float, kHaloSide * kHaloSide * kHaloSide>;

  // `blocks`: keys, ascending, each once; of the coarsest grid those of all blocks. Values begin as those of
  // the coarser grid, or 0.
  SparseGrid(int depth, std::vector<std::uint64_t> blocks, const SparseGrid* coarser);

  static std::uint64_t Key(const Place& place) {
    return std::uint64_t(place[2]) << 42 | std::uint64_t(place[1]) << 21 | std::uint64_t(place[0]);
  }
  static Place PlaceOf(std::uint64_t key) {
    constexpr std::uint64_t kMask = (1u << 21) - 1;
    return {int(key & kMask), int(key >> 21 & kMask), int(key >> 42)};
  }
  // A node in its block: 0 to 63, x fastest; and back.
  static constexpr int LocalIndex(int x, int y, int z) { return x + kSide * (y + kSide * z); }
  static constexpr Place LocalPlace(int node) {
    return {node % kSide, node / kSide % kSide, node / (kSide * kSide)};
  }
  // A node at its place in the grid.
  static Place PlaceOfNode(const Place& block, int node) {
    const Place local = LocalPlace(node);
    return {kSide * block[0] + local[0], kSide * block[1] + local[1], kSide * block[2] + local[2]};
  }
  static constexpr int HaloIndex(int x, int y, int z) {
    return x + 1 + kHaloSide * (y + 1 + kHaloSide * (z + 1));
  }

  int depth() const { return depth_; }
  int side() const { return 1 << depth_; }
  int size() const { return int(keys_.size()); }  // blocks
  std::uint64_t key(int block) const { return keys_[std::size_t(block)]; }
  int Find(const Place& place) const;  // kInactive or kOutside
  // The 27 blocks around, x fastest, itself in the middle.
  const std::array<std::int32_t, 27>& Around(int block) const { return around_[std::size_t(block)]; }

  float* Values(int block) { return values_.data() + std::size_t(block) * kNodes; }
  const float* Values(int block) const { return values_.data() + std::size_t(block) * kNodes; }
  // At a node, or beyond the cube at the nearest one.
  float At(int x, int y, int z) const;
  // Between them, trilinear.
  float Interpolated(float x, float y, float z) const;
  void Load(int block, Halo& halo) const;
  // The same of other values at the active nodes, which are zero elsewhere.
  void Load(const std::vector<float>& values, int block, Halo& halo) const;

 private:
  int depth_;
  std::vector<std::uint64_t> keys_;
  std::vector<std::array<std::int32_t, 27>> around_;
  std::vector<float> values_;
  const SparseGrid* coarser_;
};

}  // namespace polarscan
