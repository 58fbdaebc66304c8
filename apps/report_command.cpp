// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "apps/command.h"
#include "apps/report.h"
#include "core/files.h"

namespace polarscan {
namespace {

struct ReportArguments {
  std::filesystem::path scan, output;
};

}  // namespace

void AddReportCommand(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<ReportArguments>();
  CLI::App* command = app.add_subcommand("report", "One self-contained HTML page about a scan");
  command->add_option("SCAN", arguments->scan, "The scan's folder")
      ->required()
      ->check(CLI::ExistingDirectory);
  command->add_option("-o,--output", arguments->output, "The page; SCAN/report.html if not given")
      ->type_name("FILE.html");
  command->callback([arguments, &context] {
    const std::filesystem::path& output = arguments->output;
    if (!output.empty())
      RequireFree(output, [&] {
        return CarriesMark(output, "content=\"polarscan report\"") ||
               std::filesystem::equivalent(output, arguments->scan / "report.html");
      });
    if (output.empty()) arguments->output = arguments->scan / "report.html";
    WriteReport(arguments->scan, arguments->output, context.progress);
    const auto bytes = std::filesystem::file_size(arguments->output);
    context.Finish({{"report", arguments->output.string()}, {"bytes", bytes}},
                   fmt::format("{} ({:.1f} MB)", arguments->output.string(), double(bytes) / 1e6));
  });
}

}  // namespace polarscan
