// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/colmap/feature_matching.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr double kLength = 512 * 512;  // squared length of a descriptor
constexpr double kMaxAngle = 0.7;      // rad
constexpr double kMaxRatio = 0.8;
constexpr std::size_t kFewestMatches = 15;

// The two largest products of a feature with those of the other picture.
struct Best {
  int index = -1, first = -1, second = -1;
  void Offer(int product, int other) {
    if (product > first) {
      second = first;
      first = product;
      index = other;
    } else if (product > second) {
      second = product;
    }
  }
  bool IsClear() const {
    const double angle = std::acos(std::min(first / kLength, 1.0));
    return index >= 0 && angle <= kMaxAngle &&
           angle < kMaxRatio * std::acos(std::min(std::max(second, 0) / kLength, 1.0));
  }
};

// Compilers turn this loop into multiply-and-add instructions on 16-bit lanes, also without knowing the
// processor.
int Product(const std::int16_t* a, const std::int16_t* b) {
  int sum = 0;
  for (int i = 0; i < Descriptors::kSize; ++i) sum += int(a[i]) * int(b[i]);
  return sum;
}

}  // namespace

std::vector<IndexPair> MatchDescriptors(const Descriptors& a, const Descriptors& b) {
  std::vector<Best> of_a(std::size_t(a.count())), of_b(std::size_t(b.count()));
  constexpr int kBlock = 64;  // descriptors of b that stay in the nearest cache
  for (int start = 0; start < b.count(); start += kBlock) {
    const int end = std::min(b.count(), start + kBlock);
    for (int i = 0; i < a.count(); ++i) {
      const std::int16_t* row = a.values.data() + std::size_t(i) * Descriptors::kSize;
      for (int j = start; j < end; ++j) {
        const int product = Product(row, b.values.data() + std::size_t(j) * Descriptors::kSize);
        of_a[std::size_t(i)].Offer(product, j);
        of_b[std::size_t(j)].Offer(product, i);
      }
    }
  }
  std::vector<IndexPair> matches;
  for (int i = 0; i < a.count(); ++i) {
    const Best& best = of_a[std::size_t(i)];
    if (!best.IsClear()) continue;
    const Best& back = of_b[std::size_t(best.index)];
    if (back.index == i && back.IsClear()) matches.emplace_back(i, best.index);
  }
  return matches;
}

std::vector<IndexPair> AllPairs(int count) {
  std::vector<IndexPair> pairs;
  for (int i = 0; i < count; ++i)
    for (int j = i + 1; j < count; ++j) pairs.emplace_back(i, j);
  return pairs;
}

std::vector<IndexPair> NeighbourPairs(int count, int overlap) {
  std::set<IndexPair> pairs;
  const auto add = [&](int i, int step) {
    const int j = (i + step) % count;
    if (step < count && i != j) pairs.emplace(std::minmax(i, j));
  };
  for (int i = 0; i < count; ++i) {
    for (int step = 1; step <= overlap; ++step) add(i, step);
    for (int step = 16; step < count; step *= 2) add(i, step);
  }
  return {pairs.begin(), pairs.end()};
}

std::string MatchPairs(const std::vector<Descriptors>& pictures, const std::vector<IndexPair>& pairs,
                       Progress& progress) {
  std::vector<std::string> texts(pairs.size());
  progress.Begin("matching", pairs.size(), "pair");
  ParallelFor(0, int(pairs.size()), [&](int k) {
    progress.Check();
    const auto [i, j] = pairs[std::size_t(k)];
    const Descriptors &a = pictures[std::size_t(i)], &b = pictures[std::size_t(j)];
    const std::vector<IndexPair> matches = MatchDescriptors(a, b);
    progress.Advance();
    if (matches.size() < kFewestMatches) return;
    auto out = std::back_inserter(texts[std::size_t(k)]);
    fmt::format_to(out, "{} {}\n", a.name, b.name);
    for (const auto& [from, to] : matches) fmt::format_to(out, "{} {}\n", from, to);
    fmt::format_to(out, "\n");
  });
  return fmt::format("{}", fmt::join(texts, ""));
}

}  // namespace polarscan
