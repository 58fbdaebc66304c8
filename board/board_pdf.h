// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "board/board.h"

namespace polarscan {

// The bytes of a PDF file (1.4, one page, no compression) with the board at exact scale on a sheet of
// `sheet_mm`, centred between left and right; below it a ruler to check the printer by, 100 mm where the sheet
// is wide enough, and in words what the board is and how to say it to reconstruct. The content stream's unit
// is 1 mm. The sheet must be one that BoardForSheet made the board for.
std::string BoardPdf(const Board& board, const Eigen::Vector2d& sheet_mm);

}  // namespace polarscan
