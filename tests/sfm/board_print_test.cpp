// SPDX-License-Identifier: Apache-2.0
// What is printed: boards by their words, and the PDF, read as a program that knows only rectangles would.
#include <sstream>

#include "board/board_pdf.h"
#include "board/markers.h"
#include "helpers.h"

namespace polarscan {
namespace {

struct PrintedPage {
  double width_mm = 0, height_mm = 0;
  std::vector<std::array<double, 4>> rectangles;  // mm: x, y from below, width, height
};

PrintedPage ReadPage(const std::string& pdf) {
  PrintedPage page;
  const auto after = [&](const char* words) {
    return pdf.substr(pdf.find(words) + std::string(words).size());
  };
  std::istringstream box(after("/MediaBox [0 0 "));
  box >> page.width_mm >> page.height_mm;
  page.width_mm *= 25.4 / 72, page.height_mm *= 25.4 / 72;
  double scale = 0;
  std::istringstream lines(after("stream\n"));
  std::string line;
  while (std::getline(lines, line) && line != "endstream") {
    std::istringstream words(line);
    std::array<double, 4> r{};
    std::string what;
    if (line.ends_with(" cm")) words >> scale;
    if (!line.ends_with(" re")) continue;
    words >> r[0] >> r[1] >> r[2] >> r[3];
    for (double& value : r) value *= scale * 25.4 / 72;
    page.rectangles.push_back(r);
  }
  return page;
}

TEST(BoardPdf, HasExactSizes) {
  for (const char* paper : {"A4", "A3"}) {
    const Board board = BoardForSheet(paper, 25);
    const PrintedPage page = ReadPage(BoardPdf(board, SheetSize(paper)));
    EXPECT_NEAR(page.width_mm, SheetSize(paper).x(), 1e-3);
    EXPECT_NEAR(page.height_mm, SheetSize(paper).y(), 1e-3);
    double left = 1e9, right = 0, bottom = 1e9, top = 0;
    int squares = 0;
    for (const auto& r : page.rectangles)
      if (std::abs(r[2] - 25) < 1e-3 && std::abs(r[3] - 25) < 1e-3) {
        ++squares;
        left = std::min(left, r[0]), right = std::max(right, r[0] + r[2]);
        bottom = std::min(bottom, r[1]), top = std::max(top, r[1] + r[3]);
      }
    EXPECT_EQ(squares, (board.columns * board.rows + 1) / 2) << paper;
    EXPECT_NEAR(right - left, 25 * board.columns, 2e-3);
    EXPECT_NEAR(top - bottom, 25 * board.rows, 2e-3);
    EXPECT_NEAR(left + right, page.width_mm, 2e-3) << "centred";
  }
}

TEST(BoardPdf, HasARulerOf100Mm) {
  const PrintedPage page = ReadPage(BoardPdf(StandardBoards()[0], SheetSize("A4")));
  std::vector<double> ticks;
  for (const auto& r : page.rectangles)
    if (std::abs(r[2] - 0.2) < 1e-3 && r[3] > 3) ticks.push_back(r[0] + 0.1);
  ASSERT_EQ(ticks.size(), 11u);
  EXPECT_NEAR(ticks.back() - ticks.front(), 100, 1e-3);
}

TEST(BoardPdf, NamesTheBoardAsReconstructWantsIt) {
  const Board board = BoardForSheet("A4", 20);
  EXPECT_NE(BoardPdf(board, SheetSize("A4")).find("--board " + board.name), std::string::npos);
  const Board again = ParseBoard(board.name);
  EXPECT_EQ(again.columns, board.columns);
  EXPECT_EQ(again.rows, board.rows);
  EXPECT_EQ(again.square_mm, 20);
  EXPECT_EQ(again.first_id, board.first_id);
}

TEST(BoardPdf, PointsAtItsOwnObjects) {
  const std::string pdf = BoardPdf(StandardBoards()[0], SheetSize("A4"));
  const std::size_t start = std::stoul(pdf.substr(pdf.rfind("startxref\n") + 10));
  ASSERT_EQ(pdf.substr(start, 5), "xref\n");
  for (int i = 1; i <= 5; ++i) {
    const std::size_t at = std::stoul(pdf.substr(start + 9 + 20 * std::size_t(i), 10));
    EXPECT_EQ(pdf.substr(at, 7), std::to_string(i) + " 0 obj");
  }
}

TEST(Boards, ShareNoMarkers) {
  const Board &a4 = StandardBoards()[0], &a3 = StandardBoards()[1];
  EXPECT_EQ(a4.first_id + a4.Markers(), a3.first_id);
  EXPECT_EQ(a3.first_id + a3.Markers(), kFirstCustomId);
  EXPECT_EQ(int(MarkerSquares(a3).size()), a3.Markers());
  EXPECT_NE(MarkerCells(0), MarkerCells(1));
}

TEST(Boards, AreRefusedInWords) {
  for (const char* words : {"", "A5", "8x12", "8x12:", "x:20", "8x12:0", "2x12:20", "8x12:nan", "-3x12:20",
                            "999999999x999999999:20"})
    EXPECT_NE(ErrorOf([&] { ParseBoard(words); }), "") << words;
  EXPECT_NE(ErrorOf([] { ParseBoard("20x20:10"); }).find("larger squares"), std::string::npos);
  EXPECT_NE(ErrorOf([] { SheetSize("letter"); }), "");
  EXPECT_NE(ErrorOf([] { BoardForSheet("50x50", 25); }), "") << "no room";
  EXPECT_EQ(BoardForSheet("A3", 25).name, "A3");
}

}  // namespace
}  // namespace polarscan
