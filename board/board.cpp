// SPDX-License-Identifier: Apache-2.0
#include "board/board.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "board/markers.h"
#include "core/error.h"
#include "core/words.h"

namespace polarscan {
namespace {

constexpr double kSideMargin_mm = 10, kTopMargin_mm = 8, kFoot_mm = 30;  // what printers leave white; ruler
constexpr double kLeastSquare_mm = 1, kMostSquare_mm = 1000;

// Two numbers with an x between.
template <class T>
std::optional<std::pair<T, T>> TwoNumbers(const std::string& words) {
  const std::size_t cross = words.find('x');
  if (cross == std::string::npos) return {};
  const auto first = ToNumber<T>(words.substr(0, cross)), second = ToNumber<T>(words.substr(cross + 1));
  if (!first || !second) return {};
  return std::pair(*first, *second);
}

void CheckBoard(const Board& board) {
  if (!(board.square_mm >= kLeastSquare_mm && board.square_mm <= kMostSquare_mm))
    throw Error(
        fmt::format("a board's squares are {:.0f} to {:.0f} mm wide", kLeastSquare_mm, kMostSquare_mm),
        board.name);
  if (board.columns < 3 || board.rows < 3)
    throw Error("a board has three columns and rows of squares at least", board.name,
                "Choose smaller squares, or a larger sheet");
  const int left = Board::kIds - board.first_id;
  if (board.columns > 2 * left || board.rows > 2 * left || board.Markers() > left)
    throw Error(
        fmt::format("there are {} different markers for boards of one's own, and this one needs more", left),
        board.name, "Choose larger squares");
}

Board CustomBoard(int columns, int rows, double square_mm) {
  Board board{fmt::format("{}x{}:{}", columns, rows, NumberText(square_mm, false)), columns, rows, square_mm,
              kFirstCustomId};
  CheckBoard(board);
  return board;
}

}  // namespace

Eigen::Vector3d Board::GridPoint(double column, double row) const {
  return {(column - 0.5 * columns) * square_mm, (0.5 * rows - row) * square_mm, 0};
}

Eigen::Vector3d Board::Corner(int corner) const {
  return GridPoint(1 + corner % (columns - 1), 1 + corner / (columns - 1));
}

std::vector<MarkerSquare> MarkerSquares(const Board& board) {
  std::vector<MarkerSquare> squares;
  for (int row = 0; row < board.rows; ++row)
    for (int column = 0; column < board.columns; ++column)
      if ((row + column) % 2 == 1) squares.push_back({board.first_id + int(squares.size()), column, row});
  return squares;
}

const std::vector<Board>& StandardBoards() {
  static const std::vector<Board> boards = {{"A4", 7, 10, 25, 0}, {"A3", 11, 15, 25, 35}};
  return boards;
}

Board ParseBoard(const std::string& words) {
  for (const Board& board : StandardBoards())
    if (words == board.name) return board;
  const std::size_t colon = words.find(':');
  const auto size = TwoNumbers<int>(words.substr(0, colon));
  const auto square =
      colon == std::string::npos ? std::optional<double>() : ToNumber<double>(words.substr(colon + 1));
  if (!size || !square)
    throw Error("this names no board", words,
                "Say A4, A3, or COLUMNSxROWS:SQUARE in mm, as it is printed on the board, say 8x12:20");
  return CustomBoard(size->first, size->second, *square);
}

Eigen::Vector2d SheetSize(const std::string& paper) {
  if (paper == "A4") return {210, 297};
  if (paper == "A3") return {297, 420};
  const auto size = TwoNumbers<double>(paper);
  if (!size || !(size->first > 0 && size->second > 0 && size->first <= 5000 && size->second <= 5000))
    throw Error("this names no sheet of paper", paper, "Say A4, A3, or WIDTHxHEIGHT in mm, 5000 at most");
  return {size->first, size->second};
}

Board BoardForSheet(const std::string& paper, double square_mm) {
  const Eigen::Vector2d sheet = SheetSize(paper);
  for (const Board& board : StandardBoards())
    if (board.name == paper && board.square_mm == square_mm) return board;
  if (!(square_mm >= kLeastSquare_mm && square_mm <= kMostSquare_mm)) return CustomBoard(3, 3, square_mm);
  return CustomBoard(int((sheet.x() - 2 * kSideMargin_mm) / square_mm),
                     int((sheet.y() - kTopMargin_mm - kFoot_mm) / square_mm), square_mm);
}

std::vector<BlackRectangle> BlackRectangles(const Board& board) {
  std::vector<BlackRectangle> black;
  for (int row = 0; row < board.rows; ++row)
    for (int column = row % 2; column < board.columns; column += 2)
      black.push_back({double(column), double(row), 1, 1});
  constexpr double kCell = Board::kMarkerShare / Board::kMarkerCells, kMargin = (1 - Board::kMarkerShare) / 2;
  for (const MarkerSquare& square : MarkerSquares(board)) {
    const auto cells = MarkerCells(square.id);
    for (std::size_t y = 0; y < cells.size(); ++y)
      for (std::size_t x = 0; x < cells.size(); ++x) {
        if (!cells[y][x]) continue;
        const std::size_t begin = x;
        while (x + 1 < cells.size() && cells[y][x + 1]) ++x;
        black.push_back({square.column + kMargin + double(begin) * kCell,
                         square.row + kMargin + double(y) * kCell, double(x + 1 - begin) * kCell, kCell});
      }
  }
  return black;
}

Image<float> BoardPicture(const Board& board, double pixels_per_mm) {
  const double square = board.square_mm * pixels_per_mm, margin = 0.25 * square;
  const int width = 2 * int(std::ceil(0.5 * board.columns * square + margin)),
            height = 2 * int(std::ceil(0.5 * board.rows * square + margin));
  const double left = 0.5 * (width - board.columns * square), top = 0.5 * (height - board.rows * square);
  Image<float> picture(width, height, 1.0f);
  const auto overlap = [](double begin, double end, int pixel) {
    return std::clamp(end - pixel, 0.0, 1.0) - std::clamp(begin - pixel, 0.0, 1.0);
  };
  for (const BlackRectangle& r : BlackRectangles(board)) {
    const double x0 = left + r.x * square, x1 = x0 + r.width * square, y0 = top + r.y * square,
                 y1 = y0 + r.height * square;
    for (int y = int(y0); y < std::min(height, int(std::ceil(y1))); ++y)
      for (int x = int(x0); x < std::min(width, int(std::ceil(x1))); ++x)
        picture(x, y) -= float(overlap(x0, x1, x) * overlap(y0, y1, y));
  }
  for (float& value : picture.pixels()) value = std::clamp(value, 0.0f, 1.0f);
  return picture;
}

}  // namespace polarscan
