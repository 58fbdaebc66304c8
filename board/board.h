// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/image.h"

namespace polarscan {

// A printed ChArUco board: a chessboard whose white squares hold square markers (ArUco's dictionary 5x5_250;
// Garrido-Jurado et al., Pattern Recognition 2014). The square at the upper left is black; columns count to
// the right, rows down, markers along rows from first_id on. A marker's side is kMarkerShare of its square's.
// Frame of the board: millimetres, origin in the middle of the squares, x to the right, y to the sheet's
// upper edge, z out of the paper.
struct Board {
  std::string name;  // "A4", "A3", or as in --board: "8x12:20"
  int columns = 7, rows = 10;
  double square_mm = 25;
  int first_id = 0;

  static constexpr double kMarkerShare = 0.75;
  static constexpr int kMarkerCells = 7;  // a side, with the black border of one cell
  static constexpr int kIds = 250;        // of the dictionary

  int Markers() const { return columns * rows / 2; }
  int Corners() const { return (columns - 1) * (rows - 1); }
  double WidthMm() const { return columns * square_mm; }
  double HeightMm() const { return rows * square_mm; }
  // Where the grid's lines cross: column and row of lines, (0, 0) at the upper left of the squares.
  Eigen::Vector3d GridPoint(double column, double row) const;
  // An inner corner, 0 to Corners() - 1, along rows.
  Eigen::Vector3d Corner(int corner) const;
};

// A white square and its marker.
struct MarkerSquare {
  int id = 0, column = 0, row = 0;
};
std::vector<MarkerSquare> MarkerSquares(const Board& board);

// The boards that need no words: each has markers of its own. A4 and A3, squares of 25 mm.
const std::vector<Board>& StandardBoards();
// Boards of other sizes have markers from here on, so that none is taken for a standard one.
inline constexpr int kFirstCustomId = 117;

// "A4", "A3", or COLUMNSxROWS:SQUARE in mm, "8x12:20". Throws Error on other words, squares under 1 mm, fewer
// than 3 columns or rows, and more markers than the dictionary has.
Board ParseBoard(const std::string& words);

// The largest board of such squares that fits a sheet, with margins and, below, room for ruler and words. The
// standard one where it is that. Throws Error if there is none.
Board BoardForSheet(const std::string& paper, double square_mm);

// "A4", "A3", "300x400": width and height in mm. Throws Error on other words.
Eigen::Vector2d SheetSize(const std::string& paper);

// Black parts as rectangles, in squares from the upper left of the board: x, y, width, height. Runs along
// rows are one.
struct BlackRectangle {
  double x = 0, y = 0, width = 0, height = 0;
};
std::vector<BlackRectangle> BlackRectangles(const Board& board);

// 1: white, 0: black, on `pixels_per_mm` with a margin of a quarter of a square; each pixel is the mean over
// its area. The middle of the picture is the board's.
Image<float> BoardPicture(const Board& board, double pixels_per_mm);

}  // namespace polarscan
