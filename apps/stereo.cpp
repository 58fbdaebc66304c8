// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "apps/stages.h"
#include "stereo/sfm/colmap_workspace.h"
#include "stereo/workspace.h"

namespace polarscan {

namespace {

// A dense workspace that COLMAP made.
void RunWorkspace(const std::filesystem::path& folder, const StereoOptions& options, Context& context) {
  AdoptColmapWorkspace(folder, context.progress);
  EstimateDepths(folder, options, context.progress);
  const std::size_t views = ReadWorkspace(folder).views.size();
  context.Finish({{"views", views}},
                 fmt::format("maps of {} views: {}; next: polarscan fuse {}, or colmap "
                             "stereo_fusion --workspace_path {}",
                             views, (folder / "stereo").string(), folder.string(), folder.string()));
}

}  // namespace

void AddStereoCommand(CLI::App& app, Context& context) {
  struct Arguments {
    std::filesystem::path scan;
    StereoOptions options;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("stereo", "Depth and normal maps of a scan, again with other options");
  command->add_option("SCAN", a->scan, "The scan's folder, or a dense workspace by colmap image_undistorter")
      ->required()
      ->check(CLI::ExistingDirectory);
  AddOptions(*command, Table(a->options));
  command->callback([a, command, &context] {
    const StereoOptions options = StereoOptionsFrom(*command, a->options, context);
    if (IsColmapWorkspace(a->scan)) return RunWorkspace(a->scan, options, context);
    Scan scan = Scan::Open(a->scan, context.progress);
    scan.ContinueAfter("dense");
    RunStereo(scan, options);
    context.Finish(scan.state()["stages"]["stereo"],
                   fmt::format("maps: {}; next: polarscan fuse {}", (scan.dense() / "stereo").string(),
                               a->scan.string()));
  });
}

}  // namespace polarscan
