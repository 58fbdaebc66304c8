// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/colmap/feature_matching.h"

#include <algorithm>
#include <set>

#include "core/random.h"
#include "helpers.h"

namespace polarscan {
namespace {

// Random descriptors of length 512.
Descriptors RandomDescriptors(const std::string& name, int count, std::uint64_t seed) {
  Descriptors descriptors{name, {}};
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    std::vector<double> values;
    double sum = 0;
    for (int k = 0; k < Descriptors::kSize; ++k) {
      values.push_back(random.Uniform() < 0.3 ? random.Uniform() : 0.02);
      sum += values.back() * values.back();
    }
    for (const double value : values)
      descriptors.values.push_back(std::int16_t(std::lround(512 * value / std::sqrt(sum))));
  }
  return descriptors;
}

// The same descriptors in reverse order, a little changed.
Descriptors Reversed(const Descriptors& a) {
  Descriptors b{"b.png", {}};
  Random random(99);
  for (int i = a.count() - 1; i >= 0; --i)
    for (int k = 0; k < Descriptors::kSize; ++k) {
      const int value = a.values[std::size_t(i * Descriptors::kSize + k)] + int(random.Below(7)) - 3;
      b.values.push_back(std::int16_t(std::clamp(value, 0, 255)));
    }
  return b;
}

TEST(FeatureMatching, FindsTheSameFeaturesInAnotherOrder) {
  const Descriptors a = RandomDescriptors("a.png", 150, 1), b = Reversed(a);
  const auto matches = MatchDescriptors(a, b);
  ASSERT_EQ(matches.size(), 150u);
  for (const auto& [i, j] : matches) EXPECT_EQ(j, 149 - i);
}

TEST(FeatureMatching, DifferentFeaturesDoNotMatch) {
  const auto matches =
      MatchDescriptors(RandomDescriptors("a.png", 150, 1), RandomDescriptors("b.png", 150, 2));
  EXPECT_LT(matches.size(), 3u);
  EXPECT_TRUE(MatchDescriptors(RandomDescriptors("a.png", 5, 1), {"b.png", {}}).empty());
}

TEST(FeatureMatching, AFeatureWithTwoLikenessesIsAmbiguous) {
  const Descriptors a = RandomDescriptors("a.png", 30, 1);
  Descriptors twice = Reversed(a);
  const Descriptors once = twice;
  twice.values.insert(twice.values.end(), once.values.begin(), once.values.end());
  EXPECT_TRUE(MatchDescriptors(a, twice).empty());
}

// Colmap's rule, written down naively in floating point.
TEST(FeatureMatching, AgreesWithTheRuleWrittenDownNaively) {
  const Descriptors a = RandomDescriptors("a.png", 80, 5);
  Descriptors b = Reversed(a);
  Random random(3);
  for (std::size_t i = 0; i < b.values.size(); ++i) {  // the later the row, the noisier
    const int spread = 2 * int(i / 128), noise = int(random.Below(std::uint32_t(2 * spread + 1))) - spread;
    b.values[i] = std::int16_t(std::clamp(int(b.values[i]) + noise, 0, 255));
  }
  const auto angle = [&](int i, int j) {
    double sum = 0;
    for (int k = 0; k < 128; ++k)
      sum += double(a.values[std::size_t(i * 128 + k)]) * b.values[std::size_t(j * 128 + k)];
    return std::acos(std::min(1.0, sum / 512 / 512));
  };
  std::vector<IndexPair> expected;
  for (int i = 0; i < a.count(); ++i)
    for (int j = 0; j < b.count(); ++j) {
      bool good = angle(i, j) <= 0.7;
      for (int other = 0; other < a.count(); ++other)
        good = good && (other == i || angle(i, j) < 0.8 * angle(other, j));
      for (int other = 0; other < b.count(); ++other)
        good = good && (other == j || angle(i, j) < 0.8 * angle(i, other));
      if (good) expected.emplace_back(i, j);
    }
  EXPECT_GT(expected.size(), 10u);
  EXPECT_LT(expected.size(), 80u) << "the rule must reject some";
  EXPECT_EQ(MatchDescriptors(a, b), expected);
}

TEST(FeatureMatching, NeighboursCloseTheCircle) {
  const auto pairs = NeighbourPairs(60, 10);
  const std::set<IndexPair> set(pairs.begin(), pairs.end());
  EXPECT_EQ(set.size(), pairs.size());
  for (const IndexPair& pair :
       {IndexPair(0, 1), IndexPair(0, 10), IndexPair(0, 59), IndexPair(5, 55), IndexPair(0, 32)})
    EXPECT_TRUE(set.contains(pair)) << pair.first << " " << pair.second;
  EXPECT_FALSE(set.contains({0, 11}));
  for (const auto& [i, j] : pairs) EXPECT_LT(i, j);
  EXPECT_EQ(NeighbourPairs(5, 10), AllPairs(5));
  EXPECT_EQ(AllPairs(60).size(), 1770u);
}

TEST(FeatureMatching, WritesWhatColmapImports) {
  const Descriptors a = RandomDescriptors("a.png", 20, 1);
  Progress progress;
  const std::string text =
      MatchPairs({a, Reversed(a), RandomDescriptors("c.png", 20, 7)}, AllPairs(3), progress);
  EXPECT_EQ(text.substr(0, 22), "a.png b.png\n0 19\n1 18\n");
  EXPECT_TRUE(text.ends_with("\n19 0\n\n")) << text;
  EXPECT_EQ(text.find("c.png"), std::string::npos) << "too few matches";
}

}  // namespace
}  // namespace polarscan
