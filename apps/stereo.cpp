// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <charconv>

#include "apps/command.h"
#include "core/error.h"
#include "core/files/files.h"
#include "pipeline/stages.h"
#include "pipeline/stereo/stereo.h"
#include "stereo/dense/colmap/colmap_workspace.h"
#include "stereo/workspace.h"

namespace polarscan {
namespace {

struct StereoArguments {
  std::filesystem::path scan;
  std::string shard;
  int plan_shards = 0;
  double shard_wait_min = 60;
  StereoOptions options;
};

// "2/4"
Shard ParseShard(const StereoArguments& a) {
  Shard shard{0, 1, 60 * a.shard_wait_min};
  if (a.shard.empty()) return shard;
  const char *begin = a.shard.data(), *end = begin + a.shard.size();
  const auto [slash, no_index] = std::from_chars(begin, end, shard.index);
  const bool split = no_index == std::errc() && slash != end && *slash == '/';
  const auto [rest, no_count] = split ? std::from_chars(slash + 1, end, shard.count)
                                      : std::from_chars_result{begin, std::errc::invalid_argument};
  const bool sound = no_count == std::errc() && rest == end && shard.index >= 1 && shard.index <= shard.count;
  if (!sound) throw Error("a shard is given as NUMBER/COUNT, from 1/4 to 4/4", "--shard " + a.shard);
  --shard.index;
  return shard;
}

// Beside other programs that work on the same scan: scan.json stays as it is.
void RunShard(const std::filesystem::path& dense, const StereoArguments& a, const StereoOptions& options,
              Context& context) {
  EstimateMaps(dense, options, context.progress, ParseShard(a));
  context.Finish(
      {{"shard", a.shard}},
      fmt::format("shard {} is done; after the last one: the same command without --shard", a.shard));
}

// Maps that lie there before the workspace has become ours are COLMAP's own.
void Adopt(const std::filesystem::path& folder, Context& context) {
  RequireFree(
      folder / "stereo/depth_maps", [&] { return std::filesystem::exists(folder / "views.json"); },
      "Move them away, or work on a copy of the workspace");
  AdoptColmapWorkspace(folder, context.progress);
}

// A dense workspace that COLMAP made.
void RunWorkspace(const StereoArguments& a, const StereoOptions& options, Context& context) {
  const std::filesystem::path& folder = a.scan;
  Adopt(folder, context);
  if (!a.shard.empty()) return RunShard(folder, a, options, context);
  EstimateMaps(folder, options, context.progress);
  const std::size_t views = ChosenViews(ReadWorkspace(folder), options.views).views.size();
  context.Finish({{"views", views}},
                 fmt::format("maps of {} views: {}; next: polarscan fuse {}, or colmap "
                             "stereo_fusion --workspace_path {}",
                             views, (folder / "stereo").string(), folder.string(), folder.string()));
}

// The options of the command line that the shards need too, as they were given.
std::string Repeated(const nlohmann::json& given) {
  std::string words;
  for (const auto& [name, value] : given.items()) {
    if (value.is_boolean())
      words += (value.get<bool>() ? " --" : " --no-") + name;
    else
      words += fmt::format(" --{} {}", name, value.is_string() ? value.get<std::string>() : ToText(value));
  }
  return words;
}

std::string StepLines(const StereoPlan& plan) {
  std::string lines;
  for (std::size_t i = 0; i < plan.steps.size(); ++i)
    lines += fmt::format(
        "  {:2}  {}: {}\n", i + 1, plan.steps[i].title,
        i < plan.Next() ? "done" : fmt::format("{} of {} views done", plan.steps[i].done, plan.views));
  return lines;
}

// What so many shards would do: the steps, and the commands to start.
void Plan(const StereoArguments& a, const StereoOptions& options, const std::string& repeated,
          Context& context) {
  const bool foreign = IsColmapWorkspace(a.scan);
  if (foreign) Adopt(a.scan, context);
  const StereoPlan plan = PlanMaps(foreign ? a.scan : a.scan / "dense", options);
  const int count = std::min(a.plan_shards, plan.views);
  const std::string command = fmt::format("polarscan stereo {}{}", a.scan.string(), repeated);
  nlohmann::json steps = nlohmann::json::array(), shards = nlohmann::json::array();
  for (const StereoStep& step : plan.steps) steps.push_back({{"title", step.title}, {"done", step.done}});
  std::string lines;
  for (int i = 0; i < count; ++i) {
    const std::string line = fmt::format("{} --shard {}/{}", command, i + 1, count);
    shards.push_back({{"command", line}, {"views", Shard{i, count}.Share(plan.views)}});
    lines += fmt::format("  {}    {} views\n", line, Shard{i, count}.Share(plan.views));
  }
  context.Finish(
      {{"views", plan.views},
       {"pixels", plan.pixels},
       {"steps", steps},
       {"next_step", plan.Next()},
       {"shards", shards},
       {"last", command}},
      fmt::format("{} views, {:.1f} megapixels to estimate, {} steps:\n{}{} shards. Each waits for "
                  "the others after every step, so all must run at the same time:\n{}and when all "
                  "are done, once:\n  {}",
                  plan.views, plan.pixels / 1e6, plan.steps.size(), StepLines(plan), count, lines, command));
}

void Run(const StereoArguments& a, const StereoOptions& options, Context& context) {
  if (IsColmapWorkspace(a.scan)) return RunWorkspace(a, options, context);
  if (!a.shard.empty()) return RunShard(a.scan / "dense", a, options, context);
  Scan scan = Scan::Open(a.scan, context.progress);
  scan.ContinueAfter("dense");
  RunStereo(scan, options);
  context.Finish(
      ToJson(scan.state().Stage("stereo")),
      fmt::format("maps: {}; next: polarscan fuse {}", (scan.dense() / "stereo").string(), a.scan.string()));
}

}  // namespace

void AddStereoCommand(CLI::App& app, Context& context) {
  auto a = std::make_shared<StereoArguments>();
  CLI::App* command =
      app.add_subcommand("stereo", "Depth and normal maps of a scan, again with other options");
  command->add_option("SCAN", a->scan, "The scan's folder, or a dense workspace by colmap image_undistorter")
      ->required()
      ->check(IsFolder());
  command->add_option("--shard", a->shard,
                      "NUMBER/COUNT, as 2/4: make only this part of the maps, while other programs, on this "
                      "machine or on others that share the folder, make the rest");
  command
      ->add_option("--shard-wait", a->shard_wait_min, "Minutes to wait for a new map from the other shards")
      ->check(IsBetween(0.0, 1e6))
      ->capture_default_str();
  command
      ->add_option("--plan", a->plan_shards,
                   "Only say what there is to do and which commands do it in this many shards")
      ->check(IsBetween(1, 100000))
      ->type_name("COUNT");
  AddOptions(*command, Table(a->options), kStereoGroup);
  ShowFirst(*command, {"preset", "views", "masks", "filter", "sources", "levels", "cache"});
  AddExample(*command,
             "  polarscan stereo scan --preset best\n"
             "  polarscan stereo scan --plan 4            (which commands four machines would run)");
  command->callback([a, command, &context] {
    const StereoOptions options = StereoOptionsFrom(*command, a->options, context);
    if (a->plan_shards > 0)
      return Plan(*a, options, Repeated(GivenOptions(*command, Table(a->options))), context);
    Run(*a, options, context);
  });
}

}  // namespace polarscan
