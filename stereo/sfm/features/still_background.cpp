// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/features/still_background.h"

#include <algorithm>

namespace polarscan {
namespace {

constexpr int kEnoughMatches = 15;                    // in a pair; as many as the matcher asks for
constexpr double kMostStand = 0.5, kManyStand = 0.2;  // share of a pair's matches
constexpr float kStillShare = 0.002f, kLeastStillPx = 1.5f;

struct Count {
  int all = 0, still = 0;
  bool IsEnough() const { return all >= kEnoughMatches; }
  bool IsStill(double share) const { return still > 0 && IsEnough() && double(still) >= share * double(all); }
};

bool IsSet(const std::vector<bool>& flags, int i) {
  return std::size_t(i) < flags.size() && flags[std::size_t(i)];
}

// One pair's matches with both ends inside, and both outside of the masks.
struct Pair {
  Count inside, outside;
  std::vector<std::pair<IndexPair, bool>> matches;  // outside; whether it stands still
};

}  // namespace

Stillness MeasureStillness(const FeaturePlaces& places, const std::vector<PictureMatches>& matches,
                           const FeatureFlags& inside, int longest_side) {
  static const std::vector<bool> kNone;
  const float limit = std::max(kLeastStillPx, kStillShare * float(longest_side));
  const auto flags = [&](const std::string& name) -> const std::vector<bool>& {
    const auto found = inside.find(name);
    return found == inside.end() ? kNone : found->second;
  };
  Stillness result;
  std::map<std::string, std::vector<int>>
      moves;  // how many more of a feature's matches stand still than move
  for (const auto& [name, all] : places) moves[name].resize(all.size());
  for (const PictureMatches& pair : matches) {
    if (!places.contains(pair.a) || !places.contains(pair.b)) continue;
    const auto &a = places.at(pair.a), &b = places.at(pair.b);
    Pair found;
    for (const auto& [i, j] : pair.features) {
      if (std::size_t(i) >= a.size() || std::size_t(j) >= b.size()) continue;
      const bool in_a = IsSet(flags(pair.a), i), in_b = IsSet(flags(pair.b), j);
      if (in_a != in_b) continue;
      const bool still = (a[std::size_t(i)] - b[std::size_t(j)]).norm() <= limit;
      Count& count = in_a ? found.inside : found.outside;
      ++count.all;
      count.still += still;
      if (!in_a) found.matches.push_back({{i, j}, still});
    }
    if (!found.outside.IsEnough() || found.inside.IsStill(kMostStand)) continue;
    ++result.pairs;
    result.still += found.outside.IsStill(inside.empty() ? kManyStand : kMostStand);
    for (const auto& [match, still] : found.matches) {
      moves[pair.a][std::size_t(match.first)] += still ? 1 : -1;
      moves[pair.b][std::size_t(match.second)] += still ? 1 : -1;
    }
  }
  for (const auto& [name, counts] : moves)
    for (const int count : counts) result.features[name].push_back(count > 0);
  return result;
}

}  // namespace polarscan
