// SPDX-License-Identifier: Apache-2.0
#include "board/board_pdf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/words.h"

namespace polarscan {
namespace {

constexpr double kPointsPerMm = 72 / 25.4;
constexpr double kTop_mm = 8, kGap_mm = 5, kMargin_mm = 10, kTick_mm = 4, kSmallTick_mm = 2, kLine_mm = 0.2;
constexpr double kMostText_mm = 3.2, kLetterWidth = 0.53;  // of Helvetica, in its size, a safe mean

std::string RectangleMm(double x, double y, double width, double height) {
  return fmt::format("{:.4f} {:.4f} {:.4f} {:.4f} re\n", x, y, width, height);
}

// From (x, y), its upper left; PDF's y is up. Ticks stand on whole millimetres by their middles.
std::string Ruler(double x, double y, int length_mm) {
  std::string path = RectangleMm(x, y - kLine_mm, length_mm, kLine_mm);
  for (int mm = 0; mm <= length_mm; ++mm)
    path += RectangleMm(x + mm - kLine_mm / 2, y - (mm % 10 == 0 ? kTick_mm : kSmallTick_mm), kLine_mm,
                        mm % 10 == 0 ? kTick_mm : kSmallTick_mm);
  return path;
}

std::vector<std::string> BoardWords(const Board& board, int ruler_mm) {
  const std::string square = NumberText(board.square_mm, false);
  const bool standard = board.first_id < kFirstCustomId;
  return {
      fmt::format("polarscan board {}: {} x {} squares of {} mm, ArUco 5x5_250, markers {} to {}", board.name,
                  board.columns, board.rows, square, board.first_id, board.first_id + board.Markers() - 1),
      standard ? std::string("polarscan reconstruct finds it by itself")
               : fmt::format("polarscan reconstruct ... --board {}", board.name),
      fmt::format("Print at 100 %. The ruler is {} mm; if yours is not, measure the squares and say "
                  "--board-square MM",
                  ruler_mm)};
}

std::string TextLine(double x, double y, double size, const std::string& words) {
  return fmt::format("BT /F1 {:.3f} Tf {:.4f} {:.4f} Td ({}) Tj ET\n", size, x, y, words);
}

std::string Contents(const Board& board, const Eigen::Vector2d& sheet) {
  const double left = 0.5 * (sheet.x() - board.WidthMm()), top = sheet.y() - kTop_mm, s = board.square_mm;
  const double bottom = top - board.HeightMm() - kGap_mm;
  const int ruler_mm = std::min(100, 10 * int((sheet.x() - 2 * kMargin_mm) / 10));
  std::string path;
  for (const BlackRectangle& r : BlackRectangles(board))
    path += RectangleMm(left + r.x * s, top - (r.y + r.height) * s, r.width * s, r.height * s);
  path += Ruler(kMargin_mm, bottom, ruler_mm) + "f\n";
  const std::vector<std::string> words = BoardWords(board, ruler_mm);
  const std::size_t longest = std::ranges::max_element(words, {}, &std::string::size)->size();
  const double size = std::min(kMostText_mm, (sheet.x() - 2 * kMargin_mm) / (kLetterWidth * double(longest)));
  double y = bottom - kTick_mm;
  for (const std::string& line : words) path += TextLine(kMargin_mm, y -= 1.35 * size, size, line);
  return fmt::format("{0:.8f} 0 0 {0:.8f} 0 0 cm\n0 g\n", kPointsPerMm) + path;
}

}  // namespace

std::string BoardPdf(const Board& board, const Eigen::Vector2d& sheet_mm) {
  const std::string contents = Contents(board, sheet_mm);
  const std::vector<std::string> objects = {
      "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
      "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      fmt::format("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.4f} {:.4f}] /Contents 5 0 R /Resources << "
                  "/Font << /F1 4 0 R >> >> >>",
                  sheet_mm.x() * kPointsPerMm, sheet_mm.y() * kPointsPerMm),
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
      fmt::format("<< /Length {} >>\nstream\n{}endstream", contents.size(), contents)};
  std::string pdf = "%PDF-1.4\n",
              table = fmt::format("xref\n0 {}\n0000000000 65535 f \n", objects.size() + 1);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    table += fmt::format("{:010} 00000 n \n", pdf.size());
    pdf += fmt::format("{} 0 obj\n{}\nendobj\n", i + 1, objects[i]);
  }
  return pdf + table +
         fmt::format("trailer\n<< /Size {} /Root 1 0 R >>\nstartxref\n{}\n%%EOF\n", objects.size() + 1,
                     pdf.size());
}

}  // namespace polarscan
