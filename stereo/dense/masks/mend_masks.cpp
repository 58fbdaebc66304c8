// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/mend_masks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/formats/image_io.h"
#include "core/parallel.h"
#include "core/statistics.h"
#include "core/words.h"
#include "stereo/dense/masks/hull_votes.h"
#include "stereo/dense/masks/outline_cut.h"
#include "stereo/dense/masks/outline_steps.h"
#include "stereo/dense/masks/pieces.h"

namespace polarscan {
namespace {

constexpr int kAsked = 24;                       // views that are asked for the width of all masks
constexpr int kPlaces = 400;                     // of an outline
constexpr double kReachOfObject = 0.025;         // of the object's size: how far outlines may be off
constexpr int kLeastReach = 6, kMostReach = 40;  // px
constexpr double kFaint = 0.5;  // of the usual step at an outline: less is no border of the object
constexpr int kBeside = 2;      // px of the small size: what borders on a piece
constexpr std::size_t kFewestPlaces = 8;

using Mask = Image<std::uint8_t>;

// Root of the area of the object, px.
double ObjectSize(const Mask& mask) {
  return std::sqrt(double(std::ranges::count_if(mask.pixels(), [](std::uint8_t p) { return p != 0; })));
}

int Reach(double object_px) { return std::clamp(int(kReachOfObject * object_px), kLeastReach, kMostReach); }

std::vector<int> MaskedViews(const Workspace& workspace) {
  std::vector<int> masked;
  for (int i = 0; i < int(workspace.views.size()); ++i)
    if (std::filesystem::exists(workspace.MaskPath(i))) masked.push_back(i);
  return masked;
}

void For(const char* step, const std::vector<int>& views, Progress& progress,
         const std::function<void(int)>& act) {
  progress.Begin(step, views.size());
  ParallelFor(0, int(views.size()), [&](int i) {
    progress.Check();
    act(views[std::size_t(i)]);
    progress.Advance();
  });
}

// Of all masks.
double OutsideOfAll(const Workspace& workspace, const std::vector<int>& masked, Progress& progress) {
  std::vector<int> asked;
  const std::size_t count = std::min<std::size_t>(masked.size(), kAsked);
  for (std::size_t k = 0; k < count; ++k) asked.push_back(masked[k * masked.size() / count]);
  std::vector<double> sizes(workspace.views.size());
  For("size of masks", asked, progress,
      [&](int i) { sizes[std::size_t(i)] = ObjectSize(ReadViewMask(workspace, i)); });
  std::vector<double> of_asked;
  for (const int i : asked) of_asked.push_back(sizes[std::size_t(i)]);
  const int reach = Reach(Median(of_asked));
  std::vector<std::vector<float>> offsets(workspace.views.size());
  For("width of masks", asked, progress, [&](int i) {
    const auto places = OutlinePlaces(ReadViewMask(workspace, i), kPlaces, reach + kMostReach / 8);
    offsets[std::size_t(i)] = StepOffsets(LightSteps(ReadViewLight(workspace, i)), places, reach);
  });
  std::vector<float> all;
  for (const auto& of_view : offsets) all.insert(all.end(), of_view.begin(), of_view.end());
  return SystematicOffset(all, reach);
}

// The mask moved outwards by so much, and to the steps of the light.
Mask Moved(const LightSteps& light, const Mask& mask, double outside_px) {
  constexpr double kLoose = 2,
                   kLooser = 0.6;  // px, and of the offset: a square brush is wider along diagonals
  Image<float> distance = SignedDistance(mask);
  for (float& value : distance.pixels()) value -= float(outside_px);
  return CutAlongSteps(light, distance, kLoose + kLooser * std::abs(outside_px));
}

// A piece at the view's own size, widened by so many of the small pixels.
Mask AtFullSize(const Piece& piece, double scale, int width, int height, double by) {
  Mask small(int(std::ceil(width * scale)), int(std::ceil(height * scale)));
  for (const Eigen::Vector2i& at : piece.pixels) small(at.x(), at.y()) = 255;
  const Image<float> distance = SignedDistance(small);
  Mask full(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      full(x, y) = double(distance(int(x * scale), int(y * scale))) < by ? 255 : 0;
  return full;
}

// Whether the light changes little where the mask borders on a piece, compared with the rest of its outline.
bool BorderIsFaint(const LightSteps& light, const Mask& mask, const Mask& piece) {
  constexpr int kManyPlaces = 4000;
  std::vector<double> beside, elsewhere;
  for (const OutlinePlace& place : OutlinePlaces(mask, kManyPlaces, kStepAround + kBeside))
    (piece(int(place.at.x()), int(place.at.y())) ? beside : elsewhere).push_back(StepAround(light, place));
  return beside.size() >= kFewestPlaces && elsewhere.size() >= kFewestPlaces &&
         Median(beside) < kFaint * Median(elsewhere);
}

// The mask with a piece more, or less; its new border where the light changes, at most slack away.
Mask With(const LightSteps& light, const Mask& mask, const Piece& piece, const Mask& region, const Mask& hull,
          double slack_px) {
  Mask changed = mask;
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (region.pixels()[i] && (!piece.gap || hull.pixels()[i])) changed.pixels()[i] = piece.gap ? 255 : 0;
  const Mask cut = CutAlongSteps(light, SignedDistance(changed), slack_px + 2);
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (region.pixels()[i]) changed.pixels()[i] = cut.pixels()[i];
  return changed;
}

// What was mended in one view.
struct Mended {
  bool gap = false, surplus = false;
};

Mended MendPieces(const Workspace& workspace, int view, const HullVote& vote) {
  Mended mended;
  const Dispute dispute = DisputedPieces(vote);
  if (dispute.pieces.empty()) return mended;
  const LightSteps light(ReadViewLight(workspace, view));
  Mask mask = ReadViewMask(workspace, view);
  Mask hull(mask.width(), mask.height());
  for (int y = 0; y < hull.height(); ++y)
    for (int x = 0; x < hull.width(); ++x) hull(x, y) = vote.others(int(x * vote.scale), int(y * vote.scale));
  for (const Piece& piece : dispute.pieces) {
    const double wide = dispute.slack + kBeside;
    const Mask region = AtFullSize(piece, vote.scale, mask.width(), mask.height(), wide);
    if (!BorderIsFaint(light, mask, region)) continue;
    mask = With(light, mask, piece, region, hull, wide / vote.scale);
    (piece.gap ? mended.gap : mended.surplus) = true;
  }
  if (mended.gap || mended.surplus) WritePng(workspace.MaskPath(view), mask);
  return mended;
}

}  // namespace

MaskMending MendMasks(const Workspace& workspace, Progress& progress) {
  MaskMending mending;
  const std::vector<int> masked = MaskedViews(workspace);
  if (masked.empty()) return mending;
  mending.outside_px = OutsideOfAll(workspace, masked, progress);
  if (mending.outside_px != 0)
    For("outlines of masks", masked, progress, [&](int i) {
      const LightSteps light(ReadViewLight(workspace, i));
      WritePng(workspace.MaskPath(i), Moved(light, ReadViewMask(workspace, i), mending.outside_px));
    });
  const auto votes = HullVotes(
      workspace.views, [&](int i) { return ReadViewMask(workspace, i); }, progress);
  std::vector<Mended> mended(workspace.views.size());
  For("pieces of masks", masked, progress,
      [&](int i) { mended[std::size_t(i)] = MendPieces(workspace, i, votes[std::size_t(i)]); });
  for (const int i : masked) {
    if (mended[std::size_t(i)].gap) mending.gaps.push_back(workspace.views[std::size_t(i)].name);
    if (mended[std::size_t(i)].surplus) mending.surplus.push_back(workspace.views[std::size_t(i)].name);
  }
  return mending;
}

std::string MaskMendingWords(const MaskMending& mending) {
  std::vector<std::string> parts;
  if (mending.outside_px != 0)
    parts.push_back(fmt::format("all were about {:.0f} px too {}", std::abs(mending.outside_px),
                                mending.outside_px < 0 ? "wide" : "narrow"));
  const auto some = [&](const std::vector<std::string>& names, const char* what) {
    if (!names.empty())
      parts.push_back(fmt::format("{} of {} had a piece {}", names.size() == 1 ? "that" : "those",
                                  Enumerate(names), what));
  };
  some(mending.gaps, "missing");
  some(mending.surplus, "too many");
  if (parts.empty()) return "";
  std::string words = "the masks were mended: ";
  for (std::size_t i = 0; i < parts.size(); ++i) words += (i ? "; " : "") + parts[i];
  return words + ". Outlines now run where the light changes; --no-mend-masks takes the masks as they are";
}

}  // namespace polarscan
