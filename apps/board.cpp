// SPDX-License-Identifier: Apache-2.0
#include "board/board.h"

#include <fmt/format.h>

#include "apps/command.h"
#include "board/board_pdf.h"
#include "core/files/files.h"
#include "core/words.h"

namespace polarscan {
namespace {

struct BoardArguments {
  std::filesystem::path output;
  std::string paper = "A4";
  double square_mm = 25;
};

bool IsBoardPdf(const std::filesystem::path& file) {
  const std::string bytes = ReadFile(file);
  return bytes.starts_with("%PDF-1.4\n") && bytes.find("(polarscan board ") != std::string::npos;
}

void WriteBoard(const BoardArguments& a, const Context& context) {
  const Board board = BoardForSheet(a.paper, a.square_mm);
  RequireFree(a.output, [&] { return IsBoardPdf(a.output); });
  WriteFileAtomically(a.output, BoardPdf(board, SheetSize(a.paper)));
  const std::string words =
      board.first_id < kFirstCustomId ? std::string("by itself") : fmt::format("with --board {}", board.name);
  context.Finish(
      {{"file", a.output.string()},
       {"board", board.name},
       {"columns", board.columns},
       {"rows", board.rows},
       {"square_mm", board.square_mm},
       {"first_id", board.first_id}},
      fmt::format("{}: {} x {} squares of {} mm. Print it at 100 %, check its ruler; polarscan "
                  "reconstruct finds it {}",
                  a.output.string(), board.columns, board.rows, NumberText(board.square_mm, false), words));
}

}  // namespace

void AddBoardCommand(CLI::App& app, Context& context) {
  auto a = std::make_shared<BoardArguments>();
  CLI::App* command = app.add_subcommand(
      "board", "A board to print and put under the object: it gives a scan millimetres (docs/board.md)");
  command->add_option("-o,--output", a->output, "The PDF file")->required()->type_name("FILE.pdf");
  command->add_option("--paper", a->paper, "A4, A3, or WIDTHxHEIGHT in mm")
      ->type_name("SHEET")
      ->capture_default_str();
  command->add_option("--square", a->square_mm, "Side of a square, mm; larger is found from farther away")
      ->check(IsBetween(1.0, 1000.0))
      ->capture_default_str();
  AddExample(*command,
             "  polarscan board -o board.pdf\n"
             "  polarscan board -o board.pdf --paper A3 --square 30");
  command->callback([a, &context] { WriteBoard(*a, context); });
}

}  // namespace polarscan
