// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/features/poses_by_features.h"

#include <fmt/format.h>

#include <set>

#include "core/error.h"
#include "stereo/sfm/features/feature_masks.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr int kSmallPart = 3;  // pictures that make a model of their own in the end

// Images of other names than ours cannot come from our database.
void CheckNames(const std::vector<SparseModel>& models, const std::vector<ListedView>& views,
                const fs::path& where) {
  std::set<std::string> ours;
  for (const ListedView& view : views) ours.insert(view.PictureName());
  for (const SparseModel& model : models)
    for (const auto& [id, image] : model.images)
      if (!ours.contains(image.name))
        throw Error(fmt::format("COLMAP's model names a picture that it was not given: {}", image.name),
                    where.string(), "Remove this folder and run the same command again");
}

// Of each model but the first the pictures that are not in the first, where they are two at least.
std::vector<std::vector<std::string>> PiecesOf(const std::vector<SparseModel>& models) {
  std::vector<std::vector<std::string>> pieces;
  std::set<std::string> placed;
  for (std::size_t i = 0; i < models.size(); ++i) {
    std::vector<std::string> piece;
    for (const auto& [id, image] : models[i].images)
      if (i == 0 || !placed.contains(image.name)) piece.push_back(image.name);
    if (i == 0)
      placed = {piece.begin(), piece.end()};
    else if (piece.size() > 1)
      pieces.push_back(std::move(piece));
  }
  return pieces;
}

// On a scene that is mostly a plane the mapper can settle in a wrong focal length: points then miss their
// features. Another start finds the right one.
std::vector<SparseModel> TryOtherFocalLengths(const Mapping& m, std::vector<SparseModel> found) {
  const auto doubtful = [](const SparseModel& model) { return MeanError(model) > kDoubtfulError; };
  if (m.options.focal_px > 0) return found;
  for (const MappingAttempt& attempt : {MappingAttempt{"long-lens", 2.4}, MappingAttempt{"wide-lens", 0.7}}) {
    if (found.empty() || !doubtful(found[0])) break;
    m.progress.Info(fmt::format("the points miss their features by {:.1f} px; another attempt with a {}",
                                MeanError(found[0]),
                                attempt.focal_factor > 1 ? "longer lens" : "wider lens"));
    std::vector<SparseModel> models = MapViews(m, attempt);
    if (models.empty()) continue;
    const bool as_many = models[0].images.size() >= found[0].images.size();
    if (!models[0].images.empty() && !doubtful(models[0]) && as_many) found = std::move(models);
  }
  return found;
}

bool IsSound(const Mapping& m, const std::vector<SparseModel>& found) {
  const SparseModel best = BestOf(found);
  return RegisteredShare(best, m.views) >= kGoodShare && HasMoved(best);
}

// The last resort where the pictures have masks: hands and the like move against the object, but do not stand
// still. Taken if it places more views, or if the cameras had hardly moved.
void TryInsideMasks(const Mapping& m, const std::string& matcher, std::vector<SparseModel>& found,
                    Evidence& evidence) {
  if (m.options.masks != "auto" || IsSound(m, found) || !DropFeaturesOutsideOfMasks(m)) return;
  m.progress.Info(fmt::format("{} of {} views placed; another attempt with features inside of the masks only",
                              BestOf(found).images.size(), m.views.size()));
  try {
    MatchFeatures(m, matcher);
  } catch (const Error&) {  // there are no matches inside of the masks
    return;
  }
  std::vector<SparseModel> models = MapViews(m, {"inside-masks"});
  const std::size_t before = HasMoved(BestOf(found)) ? BestOf(found).images.size() : 0;
  if (BestOf(models).images.size() <= before || !HasMoved(BestOf(models))) return;
  found = std::move(models);
  evidence = {.images = ReadDatabase(m), .masked = true};
}

// How many of the views are in none of the models.
std::size_t CountUnplaced(const std::vector<SparseModel>& models, const std::vector<ListedView>& views) {
  std::set<std::string> placed;
  for (const SparseModel& model : models)
    for (const auto& [id, image] : model.images) placed.insert(image.name);
  return views.size() - placed.size();
}

// The pictures of the largest part that hangs together by pairs with as many matches as COLMAP needs to place
// one picture by another.
std::size_t LargestPart(const std::map<std::string, DatabaseImage>& images) {
  constexpr int kEnough = 30;
  std::set<std::string> reached;
  std::size_t largest = 0;
  for (const auto& [first, unused] : images) {
    std::vector<std::string> part;
    if (reached.insert(first).second) part.push_back(first);
    for (std::size_t i = 0; i < part.size(); ++i)
      for (const auto& [partner, matches] : images.at(part[i]).partners)
        if (matches >= kEnough && images.contains(partner) && reached.insert(partner).second)
          part.push_back(partner);
    largest = std::max(largest, part.size());
  }
  return largest;
}

// The least size of a model in the first attempts: COLMAP makes smaller ones again and again and throws them
// away, which where all parts are small takes long and leaves nothing.
int LeastPart(const Mapping& m) {
  const int usual = MappingAttempt().least;
  return LargestPart(ReadDatabase(m)) < std::min(std::size_t(usual), m.views.size()) ? kSmallPart : usual;
}

}  // namespace

SparseModel PosesByFeatures(const Mapping& m, Evidence& evidence) {
  ExtractFeatures(m);
  const bool automatic = m.options.matcher == "auto";
  const bool few = m.views.size() <= kExhaustiveLimit;
  std::string matcher = !automatic ? m.options.matcher : few ? "exhaustive" : "sequential";
  MatchMaskedFeatures(m, matcher);
  int least = LeastPart(m);
  std::vector<SparseModel> found = MapViews(m, {.name = "first", .least = least});
  const auto is_good = [&] { return RegisteredShare(BestOf(found), m.views) >= kGoodShare; };
  const auto improve = [&](const MappingAttempt& attempt) {
    m.progress.Info(
        fmt::format("{} of {} views placed; another attempt", BestOf(found).images.size(), m.views.size()));
    std::vector<SparseModel> models = MapViews(m, attempt);
    const std::size_t before = HasMoved(BestOf(found)) ? BestOf(found).images.size() : 0;
    if (HasMoved(BestOf(models)) && BestOf(models).images.size() > before) std::swap(found, models);
    found.insert(found.end(), models.begin(), models.end());  // they tell what hangs together
  };
  if (!IsSound(m, found) && automatic && !few) {
    MatchMaskedFeatures(m, matcher = "exhaustive");
    least = LeastPart(m);
    improve({.name = "all-pairs", .least = least});
  }
  if (!is_good()) improve({.name = "lenient", .lenient = true, .least = least});
  if (!is_good() && least > kSmallPart && CountUnplaced(found, m.views) >= std::size_t(kSmallPart))
    improve({.name = "parts", .least = kSmallPart});
  evidence = {.images = ReadDatabase(m), .masked = m.options.masks == "yes"};
  if (!IsSound(m, found)) evidence.still_background = MeasureVerifiedStillness(m).IsBackground();
  TryInsideMasks(m, matcher, found, evidence);
  found = TryOtherFocalLengths(m, std::move(found));
  CheckNames(found, m.views, m.folder / "models");
  evidence.pieces = PiecesOf(found);
  return BestOf(found);
}

}  // namespace polarscan
