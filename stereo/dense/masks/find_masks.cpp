// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/find_masks.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <numeric>

#include "core/formats/image_io.h"
#include "core/parallel.h"
#include "stereo/dense/masks/mask_fit.h"
#include "stereo/dense/masks/plain_background.h"

namespace polarscan {
namespace {

constexpr double kPlainViews = 0.9;  // share that must have a plain background
constexpr double kMostLost = 0.05;  // share of the masks' pixels that may see no place that the others allow
constexpr std::size_t kFewestViews = 4;  // masks that can tell
constexpr std::size_t kAskedFirst = 5;   // views that are asked first: most sets have no plain background

void RemoveMasks(const Workspace& workspace) {
  for (int i = 0; i < int(workspace.views.size()); ++i) std::filesystem::remove(workspace.MaskPath(i));
}

bool MakeMask(const Workspace& workspace, int view) {
  const auto mask = ObjectBeforePlainBackground(ReadViewLight(workspace, view));
  if (mask) WritePng(workspace.MaskPath(view), *mask);
  return mask.has_value();
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

}  // namespace

FoundMasks FindMasks(const Workspace& workspace, Progress& progress) {
  const std::size_t count = workspace.views.size();
  if (count < kFewestViews || !LooksPlain(workspace, progress)) return {};
  std::atomic<std::size_t> found = 0;
  progress.Begin("masks", count);
  ParallelFor(0, int(count), [&](int i) {
    progress.Check();
    found += MakeMask(workspace, i);
    progress.Advance();
  });
  if (double(found) < kPlainViews * double(count)) {
    RemoveMasks(workspace);
    return {0, fmt::format("it is in {} of {} pictures only", found.load(), count)};
  }
  const double lost = MeanLost(workspace, progress);
  if (lost > kMostLost) {
    RemoveMasks(workspace);
    return {
        0, fmt::format("what stands out of it is not one object: {:.0f} % of it sees no place that the other "
                       "views allow",
                       100 * lost)};
  }
  return {found, ""};
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
