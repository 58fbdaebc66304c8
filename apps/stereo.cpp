// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "apps/stages.h"

namespace polarscan {

void AddStereoCommand(CLI::App& app, Context& context) {
  struct Arguments {
    std::filesystem::path scan;
    StereoOptions options;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("stereo", "Depth and normal maps of a scan, again with other options");
  command->add_option("SCAN", a->scan, "The scan's folder")->required()->check(CLI::ExistingDirectory);
  AddOptions(*command, Table(a->options));
  command->callback([a, command, &context] {
    const StereoOptions options = StereoOptionsFrom(*command, a->options, context);
    Scan scan = Scan::Open(a->scan, context.progress);
    scan.ContinueAfter("dense");
    RunStereo(scan, options);
    context.Finish(scan.state()["stages"]["stereo"],
                   fmt::format("maps: {}; next: polarscan fuse {}", (scan.dense() / "stereo").string(),
                               a->scan.string()));
  });
}

}  // namespace polarscan
