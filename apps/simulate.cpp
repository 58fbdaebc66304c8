// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "acquisition/simulator.h"
#include "apps/command.h"

namespace polarscan {

void AddSimulateCommand(CLI::App& app, Context& context) {
  struct Arguments {
    SimulatorOptions options;
    std::string folder;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("simulate", "Take pictures of a made-up scene with a simulated camera");
  command->add_option("-o,--output", arguments->folder, "folder for the pictures and the truth beside them")
      ->required();
  AddOptions(*command, Table(arguments->options));
  command->callback([arguments, &context] {
    arguments->options.seed = context.seed;
    const SimulationSummary summary = Simulate(arguments->options, arguments->folder, context.progress);
    context.Finish({{"views", summary.views}, {"folder", arguments->folder}, {"gain", summary.gain}},
                   fmt::format("{} pictures and their truth in {}", summary.views, arguments->folder));
  });
}

}  // namespace polarscan
