// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "apps/command.h"
#include "core/files/files.h"
#include "pipeline/scan.h"
#include "report/report.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

struct ReportArguments {
  std::filesystem::path scan, output;
};

void Run(const ReportArguments& arguments, Context& context) {
  const fs::path own = arguments.scan / "report.html";
  const fs::path page = arguments.output.empty() ? own : arguments.output;
  if (!arguments.output.empty())
    RequireFree(
        page, [&] { return CarriesMark(page, "content=\"polarscan report\"") || fs::equivalent(page, own); });
  if (fs::weakly_canonical(page) == fs::weakly_canonical(own)) {  // a file of the scan, with its checksum
    Scan scan = Scan::Open(arguments.scan, context.progress);
    WriteReport(arguments.scan, page, context.progress);
    scan.RecordAgain("report");
  } else {
    WriteReport(arguments.scan, page, context.progress);
  }
  const auto bytes = fs::file_size(page);
  context.Finish({{"report", page.string()}, {"bytes", bytes}},
                 fmt::format("{} ({:.1f} MB)", page.string(), double(bytes) / 1e6));
}

}  // namespace

void AddReportCommand(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<ReportArguments>();
  CLI::App* command = app.add_subcommand("report", "One self-contained HTML page about a scan");
  command->add_option("SCAN", arguments->scan, "The scan's folder")->required()->check(IsFolder());
  command->add_option("-o,--output", arguments->output, "The page; SCAN/report.html if not given")
      ->type_name("FILE.html");
  AddExample(*command, "  polarscan report scan -o cup.html");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace polarscan
