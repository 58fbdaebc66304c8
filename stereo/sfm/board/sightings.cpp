// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/board/sightings.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/parallel.h"
#include "core/words.h"
#include "demosaic/stokes.h"

namespace polarscan {
namespace {

constexpr std::size_t kLeastMarkers = 4, kLeastCorners = 4;  // of a view that counts
constexpr std::size_t kLeastTwice = 3;  // markers that a view shows twice, where there are two boards
constexpr std::size_t kMirrorTrials = 3;
constexpr std::size_t kViewsAskedFirst = 5;  // views, where no board was asked for: most sets have none

// What one view shows of each candidate.
struct ViewLook {
  MarkersSeen seen;
  std::vector<std::vector<SeenCorner>> corners;
};

bool HasMarker(const Board& board, int id) {
  return id >= board.first_id && id < board.first_id + board.Markers();
}

std::size_t CountMarkers(const MarkersSeen& seen, const Board& board) {
  return std::size_t(
      std::ranges::count_if(seen.markers, [&](const auto& m) { return HasMarker(board, m.id); }));
}

// Empty where the file cannot be read: the stage that needs it says so.
Image<float> ReadS0(const std::filesystem::path& folder, const ListedView& view) {
  try {
    return ReadStokes(folder / (view.name + ".tif")).s0;
  } catch (const Error&) {
    return {};
  }
}

ViewLook LookAtView(const Image<float>& s0, const std::vector<Board>& candidates) {
  ViewLook look{SeeMarkers(s0), {}};
  for (const Board& board : candidates)
    look.corners.push_back(CountMarkers(look.seen, board) < kLeastMarkers
                               ? std::vector<SeenCorner>()
                               : FindBoardCorners(s0, look.seen, board));
  return look;
}

std::size_t CountViewsWith(const std::vector<ViewLook>& looks, const Board& board) {
  return std::size_t(std::ranges::count_if(
      looks, [&](const ViewLook& look) { return CountMarkers(look.seen, board) >= kLeastMarkers; }));
}

std::vector<std::string> ViewsWithTwoBoards(const std::vector<ViewLook>& looks,
                                            const std::vector<ListedView>& views, const Board& board) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < looks.size(); ++i)
    if (std::size_t(std::ranges::count_if(looks[i].seen.twice,
                                          [&](int id) { return HasMarker(board, id); })) >= kLeastTwice)
      names.push_back(views[i].name);
  return names;
}

// Looks at the views at these places of the list.
void LookAtViews(const std::filesystem::path& folder, const std::vector<ListedView>& views,
                 const std::vector<Board>& candidates, const std::vector<std::size_t>& which,
                 std::vector<ViewLook>& looks, Progress& progress) {
  progress.Begin("looking for a board", which.size());
  ParallelFor(0, int(which.size()), [&](int k) {
    progress.Check();
    const std::size_t i = which[std::size_t(k)];
    looks[i] = LookAtView(ReadS0(folder, views[i]), candidates);
    progress.Advance();
  });
  progress.End();
}

// Evenly spread over all of `count` views.
std::vector<bool> ViewsAskedFirst(std::size_t count, BoardChoice::Way way) {
  std::vector<bool> first(count, way == BoardChoice::Way::kYes || count <= kViewsAskedFirst);
  for (std::size_t k = 0; k < std::min(count, kViewsAskedFirst); ++k)
    first[k * count / kViewsAskedFirst] = true;
  return first;
}

std::vector<std::size_t> PlacesOf(const std::vector<bool>& flags, bool value) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < flags.size(); ++i)
    if (flags[i] == value) places.push_back(i);
  return places;
}

// Looks at all views; where no board was asked for, at the rest only if some of the first show a marker.
std::vector<ViewLook> LookAtAll(const std::filesystem::path& folder, const std::vector<ListedView>& views,
                                const std::vector<Board>& candidates, BoardChoice::Way way,
                                Progress& progress) {
  std::vector<ViewLook> looks(views.size(), {{}, std::vector<std::vector<SeenCorner>>(candidates.size())});
  const std::vector<bool> first = ViewsAskedFirst(views.size(), way);
  LookAtViews(folder, views, candidates, PlacesOf(first, true), looks, progress);
  if (std::ranges::any_of(looks, [](const ViewLook& look) { return !look.seen.markers.empty(); }))
    LookAtViews(folder, views, candidates, PlacesOf(first, false), looks, progress);
  return looks;
}

// Whether a mirror would show a board in some of the views.
bool IsMirrored(const std::filesystem::path& folder, const std::vector<ListedView>& views,
                const Progress& progress) {
  const std::size_t step = std::max<std::size_t>(1, views.size() / kMirrorTrials);
  for (std::size_t i = 0; i < views.size(); i += step) {
    progress.Check();
    if (SeeMarkers(ReadS0(folder, views[i]), true).markers.size() >= 2 * kLeastMarkers) return true;
  }
  return false;
}

// Why there is none, where there may be one: empty if there is no trace of one and none was asked for.
std::string WhyNoBoard(const std::vector<ViewLook>& looks, const std::vector<ListedView>& views,
                       const std::filesystem::path& folder, const BoardChoice& choice,
                       const Progress& progress) {
  const Board others{"", 2, Board::kIds - kFirstCustomId, 1, kFirstCustomId};
  if (!choice.board && CountViewsWith(looks, others) > 0)
    return "the pictures show a board of a size of its own; say --board COLUMNSxROWS:SQUARE, as it is "
           "printed "
           "on the board";
  if (choice.board)
    for (const Board& board : StandardBoards())
      if (board.first_id != choice.board->first_id && CountViewsWith(looks, board) > 0)
        return fmt::format("the pictures show no board {} but the board {}; say --board {}",
                           choice.board->name, board.name, board.name);
  if (IsMirrored(folder, views, progress))
    return "the board is printed mirrored: nothing can be measured by it; print it again as it is, not as a "
           "transfer or from behind";
  if (choice.way != BoardChoice::Way::kYes) return "";
  return fmt::format(
      "no picture shows four markers of the board{}; it must lie flat, sharp and lit in the "
      "pictures, a square at least 25 pixels wide",
      choice.board ? " " + choice.board->name : "");
}

}  // namespace

BoardChoice ParseBoardChoice(const std::string& words, double square_mm) {
  using Way = BoardChoice::Way;
  if (words == "no") return {Way::kNo, {}, square_mm};
  if (words == "auto") return {Way::kAuto, {}, square_mm};
  if (words == "yes") return {Way::kYes, {}, square_mm};
  return {Way::kYes, ParseBoard(words), square_mm};
}

BoardSightings LookForBoard(const std::filesystem::path& folder, const std::vector<ListedView>& views,
                            const BoardChoice& choice, Progress& progress) {
  BoardSightings found;
  if (choice.way == BoardChoice::Way::kNo) return found;
  const std::vector<Board> candidates = choice.board ? std::vector<Board>{*choice.board} : StandardBoards();
  const std::vector<ViewLook> looks = LookAtAll(folder, views, candidates, choice.way, progress);
  const auto best = std::ranges::max_element(
      candidates, {}, [&](const Board& board) { return CountViewsWith(looks, board); });
  const std::vector<std::string> two = ViewsWithTwoBoards(looks, views, *best);
  if (!two.empty()) {
    found.problem = fmt::format("there are two boards {} in {}, with the same markers: take one away",
                                best->name, Enumerate(two));
    return found;
  }
  if (CountViewsWith(looks, *best) == 0) {
    found.problem = WhyNoBoard(looks, views, folder, choice, progress);
    return found;
  }
  found.board = *best;
  if (choice.square_mm > 0) found.board->square_mm = choice.square_mm;
  for (std::size_t i = 0; i < views.size(); ++i)
    if (const auto& corners = looks[i].corners[std::size_t(best - candidates.begin())];
        corners.size() >= kLeastCorners)
      found.views.push_back({views[i].name, corners});
  if (found.views.size() < 2)
    found.problem = fmt::format("the board {} is seen well in {} only; two views at least must show it",
                                best->name, found.views.empty() ? "no view" : "view " + found.views[0].view);
  return found;
}

BoardSightings BoardFor(const std::filesystem::path& folder, const std::vector<ListedView>& views,
                        const std::string& words, double square_mm, Progress& progress) {
  const BoardChoice choice = ParseBoardChoice(words, square_mm);
  BoardSightings board = LookForBoard(folder, views, choice, progress);
  if (board.problem.empty()) return board;
  if (choice.way == BoardChoice::Way::kYes)
    throw Error(board.problem, folder.string(), "--board no goes on without one, in arbitrary units");
  progress.Warn(board.problem + "; lengths stay in arbitrary units");
  return board;
}

}  // namespace polarscan
