// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/find_masks.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <optional>

#include "core/formats/image_io.h"
#include "core/parallel.h"
#include "core/statistics.h"
#include "stereo/dense/masks/mask_fit.h"
#include "stereo/dense/masks/outline_steps.h"
#include "stereo/dense/masks/plain_background.h"
#include "stereo/dense/sources_and_depths.h"

namespace polarscan {
namespace {

constexpr double kPlainViews = 0.9;  // share that must have a plain background
constexpr double kMostLost = 0.03;   // share of the masks' pixels that may see no place that the others allow
constexpr double kFaintStep = 0.25;  // of the usual step at an outline: no border can be seen
constexpr double kMostFaint = 0.08;  // share of the outlines that may be so
constexpr int kOutlinePlaces = 400;  // of an outline
constexpr std::size_t kFewestViews = 4;  // masks that can tell
constexpr std::size_t kAskedFirst = 5;   // views that are asked first: most sets have no plain background

void RemoveMasks(const Workspace& workspace) {
  for (int i = 0; i < int(workspace.views.size()); ++i) std::filesystem::remove(workspace.MaskPath(i));
}

// Share of a mask's outline where the light changes little: what is as dark as the background ends there.
double FaintShare(const StokesImage& light, const Image<std::uint8_t>& mask) {
  const LightSteps steps(light);
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
std::optional<double> MakeMask(const Workspace& workspace, int view) {
  const StokesImage light = ReadViewLight(workspace, view);
  const auto mask = ObjectBeforePlainBackground(light);
  if (!mask) return std::nullopt;
  WritePng(workspace.MaskPath(view), *mask);
  return FaintShare(light, *mask);
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
                   Progress& progress) {
  std::vector<double> shares;
  for (const auto& share : faint)
    if (share) shares.push_back(*share);
  if (double(shares.size()) < kPlainViews * double(faint.size()))
    return fmt::format("it is in {} of {} pictures only", shares.size(), faint.size());
  if (const double mean = std::accumulate(shares.begin(), shares.end(), 0.0) / double(shares.size());
      mean > kMostFaint)
    return fmt::format(
        "{:.0f} % of the object's outline cannot be told from it (is a side of it in the dark?)", 100 * mean);
  if (const double lost = MeanLost(workspace, progress); lost > kMostLost)
    return fmt::format(
        "what stands out of it is not one object: {:.0f} % of it sees no place that the other views "
        "allow",
        100 * lost);
  return "";
}

}  // namespace

FoundMasks FindMasks(const SparseModel& model, Workspace& workspace, Progress& progress) {
  const std::size_t count = workspace.views.size();
  if (count < kFewestViews || !LooksPlain(workspace, progress)) return {};
  std::vector<std::optional<double>> faint(count);
  progress.Begin("masks", count);
  ParallelFor(0, int(count), [&](int i) {
    progress.Check();
    faint[std::size_t(i)] = MakeMask(workspace, i);
    progress.Advance();
  });
  const std::vector<DenseView> before = workspace.views;
  SetDepthRanges(model, workspace, progress);
  std::string why_not = WhyNot(workspace, faint, progress);
  if (why_not.empty())
    return {std::size_t(std::ranges::count_if(faint, [](auto f) { return f.has_value(); })), ""};
  RemoveMasks(workspace);
  workspace.views = before;
  return {0, std::move(why_not)};
}

std::string FoundMasksWords(const FoundMasks& found) {
  if (found.views > 0)
    return fmt::format(
        "no masks were given, and the background is plain: masks were made of what stands out of it in "
        "{} pictures (--no-find-masks does without)",
        found.views);
  if (found.why_not.empty()) return "";
  return "the background looks plain, but no masks were made of it: " + found.why_not;
}

}  // namespace polarscan
