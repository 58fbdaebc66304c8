// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/features/feature_masks.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/formats/image_io.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// True for the features inside of a picture's mask; no entry for pictures without a mask.
FeatureFlags InsideMasks(const Mapping& m, const FeaturePlaces& places) {
  FeatureFlags inside;
  for (const ListedView& view : m.views) {
    const fs::path path = m.pictures / "masks" / view.PictureName();
    const auto found = places.find(view.PictureName());
    if (found == places.end() || !fs::exists(path)) continue;
    m.progress.Check();
    const Image<std::uint8_t> mask = ReadMask(path);
    const auto cell = [](float place, int size, int picture) {
      return std::clamp(int(place * float(size) / float(picture)), 0, size - 1);
    };
    for (const Eigen::Vector2f& place : found->second)
      inside[found->first].push_back(
          mask(cell(place.x(), mask.width(), view.width), cell(place.y(), mask.height(), view.height)) > 0);
  }
  return inside;
}

FeatureFlags Opposite(FeatureFlags flags) {
  for (auto& [name, all] : flags) all.flip();
  return flags;
}

std::size_t CountSet(const FeatureFlags& flags) {
  std::size_t count = 0;
  for (const auto& [name, all] : flags) count += std::size_t(std::ranges::count(all, true));
  return count;
}

std::size_t CountAll(const FeaturePlaces& places) {
  std::size_t count = 0;
  for (const auto& [name, all] : places) count += all.size();
  return count;
}

int LongestSide(const Mapping& m) {
  int longest = 0;
  for (const ListedView& view : m.views) longest = std::max({longest, view.width, view.height});
  return longest;
}

// Without its note the database is not gone on with: the next run begins with all features again.
void Drop(const Mapping& m, const FeatureFlags& dropped) {
  fs::remove(m.database_note());
  DropFeatures(m.database(), dropped);
}

}  // namespace

bool DropFeaturesOutsideOfMasks(const Mapping& m) {
  const FeatureFlags outside = Opposite(InsideMasks(m, ReadFeaturePlaces(m.database())));
  if (CountSet(outside) == 0) return false;
  Drop(m, outside);
  return true;
}

// Where there are no masks and all pairs were matched: what stands still in most of them is no part of what turns.
void DropStillFeatures(const Mapping& m, const std::string& matcher) {
  const Stillness stillness = MeasureStillness(
      ReadFeaturePlaces(m.database()), ReadMatches(m.database(), Matches::kFound), {}, LongestSide(m));
  if (!stillness.IsBackground()) return;
  m.progress.Info(
      fmt::format("poses without {} features that stand still in {} of {} pairs of pictures: the object "
                  "turns before a background (--sfm-masks no takes all of them)",
                  CountSet(stillness.features), stillness.still, stillness.pairs));
  Drop(m, stillness.features);
  MatchFeatures(m, matcher);
}

void MatchMaskedFeatures(const Mapping& m, const std::string& matcher) {
  const FeaturePlaces places = m.options.masks == "no" ? FeaturePlaces() : ReadFeaturePlaces(m.database());
  const FeatureFlags inside = InsideMasks(m, places), outside = Opposite(inside);
  if (inside.empty()) {
    MatchFeatures(m, matcher);
    if (m.options.masks == "auto" && matcher == "exhaustive") DropStillFeatures(m, matcher);
    return;
  }
  const std::size_t all = CountAll(places);
  if (m.options.masks == "yes") {
    if (CountSet(outside) == all)
      throw Error("no feature lies inside of the masks", (m.pictures / "masks").string(),
                  "Look at the masks; --sfm-masks no takes the poses from the whole pictures");
    Drop(m, outside);
    m.progress.Info(fmt::format("poses from inside of the masks: {} of {} features (--sfm-masks yes)",
                                all - CountSet(outside), all));
    return MatchFeatures(m, matcher);
  }
  MatchFeatures(m, matcher);
  const Stillness stillness =
      MeasureStillness(places, ReadMatches(m.database(), Matches::kFound), inside, LongestSide(m));
  const std::string why = fmt::format("the background stands still in {} of {} pairs of pictures",
                                      stillness.still, stillness.pairs);
  if (!stillness.IsBackground())
    return m.progress.Info(fmt::format("poses from the whole pictures: {} (--sfm-masks auto)", why));
  m.progress.Info(fmt::format("poses without {} of {} features outside of the masks: {} (--sfm-masks auto)",
                              CountSet(stillness.features), CountSet(outside), why));
  Drop(m, stillness.features);
  MatchFeatures(m, matcher);
}

Stillness MeasureVerifiedStillness(const Mapping& m) {
  return MeasureStillness(ReadFeaturePlaces(m.database()), ReadMatches(m.database(), Matches::kVerified), {},
                          LongestSide(m));
}

}  // namespace polarscan
