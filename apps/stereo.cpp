// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <charconv>

#include "apps/stages.h"
#include "core/error.h"
#include "stereo/sfm/colmap_workspace.h"
#include "stereo/workspace.h"

namespace polarscan {
namespace {

struct StereoArguments {
  std::filesystem::path scan;
  std::string shard;
  double shard_wait_min = 60;
  StereoOptions options;
};

// "2/4"
Shard ParseShard(const StereoArguments& a) {
  Shard shard{0, 1, 60 * a.shard_wait_min};
  if (a.shard.empty()) return shard;
  const char *begin = a.shard.data(), *end = begin + a.shard.size();
  const auto [slash, no_index] = std::from_chars(begin, end, shard.index);
  const bool sound = no_index == std::errc() && slash != end && *slash == '/' &&
                     std::from_chars(slash + 1, end, shard.count).ptr == end && shard.index >= 1 &&
                     shard.index <= shard.count;
  if (!sound) throw Error("a shard is given as NUMBER/COUNT, from 1/4 to 4/4", "--shard " + a.shard);
  --shard.index;
  return shard;
}

// Beside other programs that work on the same scan: scan.json stays as it is.
void RunShard(const std::filesystem::path& dense, const StereoArguments& a, const StereoOptions& options,
              Context& context) {
  EstimateDepths(dense, options, context.progress, ParseShard(a));
  context.Finish(
      {{"shard", a.shard}},
      fmt::format("shard {} is done; after the last one: the same command without --shard", a.shard));
}

// A dense workspace that COLMAP made.
void RunWorkspace(const StereoArguments& a, const StereoOptions& options, Context& context) {
  const std::filesystem::path& folder = a.scan;
  AdoptColmapWorkspace(folder, context.progress);
  if (!a.shard.empty()) return RunShard(folder, a, options, context);
  EstimateDepths(folder, options, context.progress);
  const std::size_t views = ReadWorkspace(folder).views.size();
  context.Finish({{"views", views}},
                 fmt::format("maps of {} views: {}; next: polarscan fuse {}, or colmap "
                             "stereo_fusion --workspace_path {}",
                             views, (folder / "stereo").string(), folder.string(), folder.string()));
}

void Run(const StereoArguments& a, const StereoOptions& options, Context& context) {
  if (IsColmapWorkspace(a.scan)) return RunWorkspace(a, options, context);
  if (!a.shard.empty()) return RunShard(a.scan / "dense", a, options, context);
  Scan scan = Scan::Open(a.scan, context.progress);
  scan.ContinueAfter("dense");
  RunStereo(scan, options);
  context.Finish(
      scan.state()["stages"]["stereo"],
      fmt::format("maps: {}; next: polarscan fuse {}", (scan.dense() / "stereo").string(), a.scan.string()));
}

}  // namespace

void AddStereoCommand(CLI::App& app, Context& context) {
  auto a = std::make_shared<StereoArguments>();
  CLI::App* command =
      app.add_subcommand("stereo", "Depth and normal maps of a scan, again with other options");
  command->add_option("SCAN", a->scan, "The scan's folder, or a dense workspace by colmap image_undistorter")
      ->required()
      ->check(CLI::ExistingDirectory);
  command->add_option("--shard", a->shard,
                      "NUMBER/COUNT, as 2/4: make only this part of the maps, while other programs, on this "
                      "machine or on others that share the folder, make the rest");
  command
      ->add_option("--shard-wait", a->shard_wait_min, "Minutes to wait for a new map from the other shards")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  AddOptions(*command, Table(a->options));
  command->callback(
      [a, command, &context] { Run(*a, StereoOptionsFrom(*command, a->options, context), context); });
}

}  // namespace polarscan
