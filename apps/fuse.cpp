// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "apps/stages.h"

namespace polarscan {
namespace {

struct FuseArguments {
  std::filesystem::path scan;
  FusionOptions options;
  bool repair = false;
};

void Run(const FuseArguments& arguments, Context& context) {
  Scan scan = Scan::Open(arguments.scan, context.progress);
  if (arguments.repair) {
    scan.ContinueAfter("dense");
    RunStereo(scan, RecordedStereoOptions(scan));
  } else {
    scan.ContinueAfter("stereo");
  }
  RunFusion(scan, arguments.options);
  context.data_lost = MapsWereDamaged(scan);
  nlohmann::json result = scan.Counts("fusion");
  result["cloud"] = scan.cloud().string();
  context.Finish(result, fmt::format("{} points from {} views, each seen by {:.1f} on average: {}",
                                     result.at("points").get<std::size_t>(), result.at("views").get<int>(),
                                     result.at("mean_views").get<double>(), scan.cloud().string()));
}

}  // namespace

void AddFuseCommand(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<FuseArguments>();
  CLI::App* command = app.add_subcommand("fuse", "Fuses a scan's depth maps into SCAN/cloud.ply");
  command->add_option("SCAN", arguments->scan, "The scan's folder")
      ->required()
      ->check(CLI::ExistingDirectory);
  command->add_flag("--repair", arguments->repair,
                    "Estimate maps that are missing or damaged again first, with the scan's stereo options");
  AddOptions(*command, Table(arguments->options));
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace polarscan
