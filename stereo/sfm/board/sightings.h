// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "board/corners.h"
#include "core/progress.h"
#include "stereo/sfm/view_list.h"

namespace polarscan {

// What --board and --board-square ask for.
struct BoardChoice {
  enum class Way { kNo, kAuto, kYes } way = Way::kAuto;
  std::optional<Board> board;  // none: any of StandardBoards(), told by its markers
  double square_mm = 0;        // as measured after printing; 0: as designed
};

// words: "auto", "no", "yes", or a board's (ParseBoard). Throws Error on other words.
BoardChoice ParseBoardChoice(const std::string& words, double square_mm);

// The board's corners in one view.
struct BoardSighting {
  std::string view;  // name
  std::vector<SeenCorner> corners;
};

// The board that the views show, if they show one. problem: a sentence about a board that is there and of no
// use (mirrored, twice, another size, in one view), or, where it was asked for, not there; else empty.
struct BoardSightings {
  std::optional<Board> board;  // its square as measured
  std::vector<BoardSighting> views;
  std::string problem;
};

// Looks for the chosen board in S0 of all views, which lie in `folder`. Views that show fewer than four
// markers or corners of it do not count. Of two boards the one that more views show is taken. Where none was asked for, five views spread over
// all are looked at first, and the others only if one of these shows a marker.
BoardSightings LookForBoard(const std::filesystem::path& folder, const std::vector<ListedView>& views,
                            const BoardChoice& choice, Progress& progress);

// The same by the options --board and --board-square. A board that was asked for and is of no use is an error,
// one that was not a warning.
BoardSightings BoardFor(const std::filesystem::path& folder, const std::vector<ListedView>& views,
                        const std::string& words, double square_mm, Progress& progress);

}  // namespace polarscan
