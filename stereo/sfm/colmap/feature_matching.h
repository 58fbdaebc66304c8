// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/progress.h"

namespace polarscan {

// SIFT descriptors of one picture as COLMAP stores them: 128 bytes each, length about 512.
struct Descriptors {
  static constexpr int kSize = 128;
  std::string name;
  std::vector<std::int16_t> values;  // kSize per feature; 16 bits, because products of pairs are summed

  int count() const { return int(values.size() / kSize); }
};

using IndexPair = std::pair<int, int>;

// Features that are each other's nearest by the angle between descriptors, at most 0.7 rad apart and nearer
// than 0.8 of the second nearest on both sides: COLMAP's rule and defaults, but over all features instead of
// a search tree's guess, and about ten times as fast on a CPU. Exact integers: the same on every machine.
std::vector<IndexPair> MatchDescriptors(const Descriptors& a, const Descriptors& b);

// All pairs (i < j) of `count` pictures.
std::vector<IndexPair> AllPairs(int count);
// Each picture with the next `overlap` ones and with those 16, 32, 64, ... further on, the order being a
// circle.
std::vector<IndexPair> NeighbourPairs(int count, int overlap);

// Matches all pairs, in parallel, and returns them as COLMAP's matches_importer reads raw matches: for each
// pair the two names, a line per match with the two indices, and an empty line. Pairs with fewer than 15
// matches are left out.
std::string MatchPairs(const std::vector<Descriptors>& pictures, const std::vector<IndexPair>& pairs,
                       Progress& progress);

}  // namespace polarscan
