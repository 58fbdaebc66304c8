// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "apps/command.h"
#include "core/files/files.h"
#include "fusion/cloud/cloud.h"
#include "pipeline/stages.h"
#include "stereo/dense/colmap/colmap_workspace.h"

namespace polarscan {
namespace {

struct FuseArguments {
  std::filesystem::path scan;
  FusionOptions options;
  bool repair = false;
};

// The cloud and what is known of it.
std::pair<std::filesystem::path, nlohmann::json> Fuse(const FuseArguments& arguments, Context& context) {
  if (IsColmapWorkspace(arguments.scan)) {
    const auto cloud = arguments.scan / "cloud.ply";
    RequireFree(
        cloud, [&] { return CarriesMark(cloud, PointProperties() + "end_header"); }, "Move it away");
    const nlohmann::json counts =
        ToJson(FuseCloud(arguments.scan, cloud, arguments.options, context.progress));
    for (const std::string& doubt : Doubts(counts, arguments.options.min_views)) context.progress.Warn(doubt);
    return {cloud, counts};
  }
  Scan scan = Scan::Open(arguments.scan, context.progress);
  if (arguments.repair) {
    scan.ContinueAfter("dense");
    RunStereo(scan, RecordedStereoOptions(scan));
  } else {
    scan.ContinueAfter("stereo");
  }
  RunFusion(scan, arguments.options);
  context.data_lost = MapsWereDamaged(scan);
  return {scan.cloud(), scan.Counts("fusion")};
}

void Run(const FuseArguments& arguments, Context& context) {
  auto [cloud, result] = Fuse(arguments, context);
  result["cloud"] = cloud.string();
  if (context.data_lost)
    context.progress.Warn("polarscan fuse --repair estimates the maps of views that were left out again");
  context.Finish(result, fmt::format("{} points from {} views, each seen by {:.1f} on average: {}",
                                     result.at("points").get<std::size_t>(), result.at("views").get<int>(),
                                     result.at("mean_views").get<double>(), cloud.string()));
}

}  // namespace

void AddFuseCommand(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<FuseArguments>();
  CLI::App* command = app.add_subcommand("fuse", "Fuses a scan's depth maps into SCAN/cloud.ply");
  command->add_option("SCAN", arguments->scan, "The scan's folder, or a dense workspace by COLMAP")
      ->required()
      ->check(IsFolder());
  command->add_flag("--repair", arguments->repair,
                    "Estimate maps that are missing or damaged again first, with the scan's stereo options");
  AddOptions(*command, Table(arguments->options));
  AddExample(*command, "  polarscan fuse scan --fusion-min-views 2");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace polarscan
