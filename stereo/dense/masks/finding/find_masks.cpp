// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/finding/find_masks.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <optional>

#include "core/formats/image_io.h"
#include "core/parallel.h"
#include "core/statistics.h"
#include "stereo/dense/masks/finding/plain_background.h"
#include "stereo/dense/masks/finding/specks.h"
#include "stereo/dense/masks/finding/still_background.h"
#include "stereo/dense/masks/finding/still_views.h"
#include "stereo/dense/masks/hull_votes.h"
#include "stereo/dense/masks/mask_fit.h"
#include "stereo/dense/masks/outline_steps.h"
#include "stereo/dense/sources_and_depths.h"

namespace polarscan {
namespace {

constexpr double kPlainViews = 0.9;  // share that must have a plain background
constexpr double kMostLost = 0.03;   // share of the masks' pixels that may see no place that the others allow
constexpr double kMostLostBeforeStill = 0.15;  // where what no view shows free counts as object
constexpr double kFaintStep = 0.25;            // of the usual step at an outline: no border can be seen
constexpr double kMostFaint = 0.08;            // share of the outlines that may be so
constexpr double kMostOfBorder =
    1. / 3;  // share of the picture's border that may be object before what stands still
constexpr double kHullMargin = 0.03;  // of the object's size: how far outside of the others' hull it may be
constexpr int kOutlinePlaces = 400;   // of an outline
constexpr std::size_t kFewestViews = 4;  // masks that can tell
constexpr std::size_t kAskedFirst = 5;   // views that are asked first: most sets have no plain background

void RemoveMasks(const Workspace& workspace) {
  for (int i = 0; i < int(workspace.views.size()); ++i) std::filesystem::remove(workspace.MaskPath(i));
}

// Share of a mask's outline where the light changes little: what is as dark as the background ends there.
double FaintShare(const LightSteps& steps, const Image<std::uint8_t>& mask) {
  std::vector<double> at_outline;
  for (const OutlinePlace& place : OutlinePlaces(mask, kOutlinePlaces, 2 * kStepAround))
    at_outline.push_back(StepAround(steps, place));
  if (at_outline.empty()) return 0;
  const double usual = Median(at_outline);
  const auto faint =
      std::ranges::count_if(at_outline, [&](double step) { return step < kFaintStep * usual; });
  return double(faint) / double(at_outline.size());
}

// The share of its outline that is faint; none: there is no mask.
std::optional<double> MakePlainMask(const Workspace& workspace, int view) {
  const StokesImage light = ReadViewLight(workspace, view);
  const auto mask = ObjectBeforePlainBackground(light);
  if (!mask) return std::nullopt;
  WritePng(workspace.MaskPath(view), *mask);
  return FaintShare(LightSteps(light), *mask);
}

// Of some views, spread over all, how many get a mask.
bool LooksPlain(const Workspace& workspace, Progress& progress) {
  const std::size_t count = workspace.views.size(), asked = std::min(count, kAskedFirst);
  std::atomic<std::size_t> plain = 0;
  ParallelFor(0, int(asked), [&](int k) {
    progress.Check();
    const int view = int(std::size_t(k) * count / asked);
    plain += ObjectBeforePlainBackground(ReadViewLight(workspace, view)).has_value();
  });
  return 2 * plain > asked;
}

double MeanLost(const Workspace& workspace, Progress& progress) {
  const auto lost = MasksThatDoNotFit(workspace, progress);
  return std::accumulate(lost.begin(), lost.end(), 0.0,
                         [](double sum, const auto& of) { return sum + of.second; }) /
         double(std::max<std::size_t>(1, lost.size()));
}

// What speaks against the masks that were made; empty: nothing.
std::string WhyNot(const Workspace& workspace, const std::vector<std::optional<double>>& faint,
                   double most_lost, Progress& progress) {
  std::vector<double> shares;
  for (const auto& share : faint)
    if (share) shares.push_back(*share);
  if (double(shares.size()) < kPlainViews * double(faint.size()))
    return fmt::format("it is in {} of {} pictures only", shares.size(), faint.size());
  if (const double mean = std::accumulate(shares.begin(), shares.end(), 0.0) / double(shares.size());
      mean > kMostFaint)
    return fmt::format(
        "{:.0f} % of the object's outline cannot be told from it (is a side of it in the dark?)", 100 * mean);
  if (const double lost = MeanLost(workspace, progress); lost > most_lost)
    return fmt::format(
        "what stands out of it is not one object: {:.0f} % of it sees no place that the other views "
        "allow",
        100 * lost);
  return "";
}

double ShareOfBorder(const Image<std::uint8_t>& mask) {
  std::size_t all = 0, object = 0;
  const auto ask = [&](int x, int y) { ++all, object += mask(x, y) != 0; };
  for (int x = 0; x < mask.width(); ++x) ask(x, 0), ask(x, mask.height() - 1);
  for (int y = 0; y < mask.height(); ++y) ask(0, y), ask(mask.width() - 1, y);
  return double(object) / double(all);
}

// Takes out of the masks what lies outside of the hull of the others: a hand, a person in the room. Sixteen masks at least
// (hull_votes.h).
void CutToHull(const Workspace& workspace, Progress& progress) {
  const auto votes = HullVotes(
      workspace.views, [&](int i) { return ReadViewMask(workspace, i); }, progress);
  ParallelFor(0, int(votes.size()), [&](int i) {
    const HullVote& vote = votes[std::size_t(i)];
    if (vote.others.empty()) return;
    progress.Check();
    const Image<float> distance = SignedDistance(vote.others);
    const auto hull = double(std::ranges::count(vote.others.pixels(), 255));
    const double margin = std::max(2.0, kHullMargin * std::sqrt(hull));
    Image<std::uint8_t> mask = ReadViewMask(workspace, i);
    bool changed = false;
    for (int y = 0; y < mask.height(); ++y)
      for (int x = 0; x < mask.width(); ++x)
        if (mask(x, y) && double(distance(int(x * vote.scale), int(y * vote.scale))) > margin)
          mask(x, y) = 0, changed = true;
    if (!changed) return;
    DropSpecks(mask);
    WritePng(workspace.MaskPath(i), mask);
  });
}

using FaintShares = std::vector<std::optional<double>>;  // of each view; none: it has no mask

FaintShares MakePlainMasks(const Workspace& workspace, Progress& progress) {
  const std::size_t count = workspace.views.size();
  FaintShares faint(count);
  progress.Begin("masks", count);
  ParallelFor(0, int(count), [&](int i) {
    progress.Check();
    faint[std::size_t(i)] = MakePlainMask(workspace, i);
    progress.Advance();
  });
  return faint;
}

FaintShares MakeStillMasks(const Workspace& workspace, const std::vector<std::vector<int>>& groups,
                           Progress& progress) {
  FaintShares faint(workspace.views.size());
  for (const std::vector<int>& group : groups) {
    const StillBackground background(workspace, group, progress);
    progress.Begin("masks", group.size());
    ParallelFor(0, int(group.size()), [&](int k) {
      progress.Check();
      const int view = group[std::size_t(k)];
      StokesImage difference;
      const auto mask = background.ObjectIn(ReadViewLight(workspace, view), &difference);
      progress.Advance();
      if (ShareOfBorder(mask) > kMostOfBorder) return;
      WritePng(workspace.MaskPath(view), mask);
      faint[std::size_t(view)] = FaintShare(LightSteps(difference), mask);
    });
  }
  return faint;
}

}  // namespace

FoundMasks FindMasks(const SparseModel& model, Workspace& workspace, Progress& progress) {
  const std::size_t count = workspace.views.size();
  if (count < kFewestViews) return {};
  FoundMasks found;
  std::vector<std::optional<double>> faint;
  if (LooksPlain(workspace, progress)) {
    found.background = FoundMasks::kPlain;
    faint = MakePlainMasks(workspace, progress);
  } else if (const auto groups = GroupsBeforeOneBackground(workspace, progress); !groups.empty()) {
    found.background = FoundMasks::kStill;
    faint = MakeStillMasks(workspace, groups, progress);
  } else {
    return {};
  }
  const std::vector<DenseView> before = workspace.views;
  SetDepthRanges(model, workspace, progress);
  found.why_not = WhyNot(workspace, faint,
                         found.background == FoundMasks::kStill ? kMostLostBeforeStill : kMostLost, progress);
  if (found.why_not.empty()) {
    CutToHull(workspace, progress);
    SetDepthRanges(model, workspace, progress);
    found.views = std::size_t(std::ranges::count_if(faint, [](auto f) { return f.has_value(); }));
  } else {
    RemoveMasks(workspace);
    workspace.views = before;
  }
  return found;
}

std::string FoundMasksWords(const FoundMasks& found) {
  const bool plain = found.background == FoundMasks::kPlain;
  if (found.views > 0)
    return fmt::format(
        "no masks were given, and the background {}: masks were made of what {} in {} pictures "
        "(--no-find-masks does "
        "without)",
        plain ? "is plain" : "stands still", plain ? "stands out of it" : "moves before it", found.views);
  if (found.why_not.empty()) return "";
  return fmt::format("the background {}, but no masks were made of it: {}",
                     plain ? "looks plain" : "seems to stand still", found.why_not);
}

}  // namespace polarscan
