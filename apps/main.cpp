// SPDX-License-Identifier: Apache-2.0
#include <tbb/global_control.h>

#include <cstdlib>
#include <limits>
#include <new>
#include <optional>

#include "apps/command.h"
#include "apps/interrupt.h"
#include "apps/memory_limit.h"
#include "core/error.h"

namespace polarscan {
namespace {

enum ExitCode { kDone = 0, kFailed = 1, kWrongUsage = 2, kDataLost = 3 };

struct GlobalOptions {
  int threads = 0;
  bool verbose = false, quiet = false;
};

void AddGlobalOptions(CLI::App& app, GlobalOptions& options, Context& context) {
  app.add_flag("--json", context.json, "The result as JSON on stdout; messages stay on stderr");
  app.add_option("--threads", options.threads, "Threads to compute with; 0: one a processor")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  app.add_option("--seed", context.seed, "Seed of all random numbers: the same seed gives the same bytes")
      ->check(CLI::Range(0, std::numeric_limits<int>::max()))
      ->capture_default_str();
  CLI::Option* verbose = app.add_flag("-v,--verbose", options.verbose, "Say more");
  app.add_flag("-q,--quiet", options.quiet, "Warnings and errors only")->excludes(verbose);
  app.set_config("--config", "", "A TOML file: options by name under the command's [section]")
      ->type_name("FILE.toml");
  app.set_version_flag("--version", "polarscan " POLARSCAN_VERSION);
}

void AddCommands(CLI::App& app, Context& context) {
  AddDoctorCommand(app, context);
  AddSimulateCommand(app, context);
  AddCamerasCommand(app, context);
  AddCaptureCommand(app, context);
  AddCalibrateCommand(app, context);
  AddCheckCommand(app, context);
  AddImportCommand(app, context);
  AddExportCommand(app, context);
  AddReconstructCommand(app, context);
  AddDemosaicCommand(app, context);
  AddSfmCommand(app, context);
  AddStereoCommand(app, context);
  AddFuseCommand(app, context);
  AddMeshCommand(app, context);
  AddEvaluateCommand(app, context);
  AddReplayCommand(app, context);
  AddReportCommand(app, context);
  AddHelpCommand(app, context);
}

int Run(int argc, char** argv) {
  Terminal terminal;
  Context context{terminal};
  GlobalOptions options;
  std::optional<tbb::global_control> threads;

  CLI::App app("polarscan turns a polarization camera into a 3D scanner", "polarscan");
  app.require_subcommand(1);
  app.fallthrough();
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.get_formatter()->column_width(36);
  AddGlobalOptions(app, options, context);
  AddCommands(app, context);
  app.parse_complete_callback([&] {
    using Level = Terminal::Level;
    terminal.SetLevel(options.quiet ? Level::kQuiet : options.verbose ? Level::kVerbose : Level::kNormal);
    if (options.threads > 0)
      threads.emplace(tbb::global_control::max_allowed_parallelism, std::size_t(options.threads));
  });

  StopOnInterrupt(terminal);
  LimitMemory();
  try {
    app.parse(argc, argv);
    return context.data_lost ? kDataLost : context.not_ready ? kFailed : kDone;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kWrongUsage;
  } catch (const std::bad_alloc&) {
    terminal.End();
    terminal.Fail(
        "there is not enough memory for this: close other programs, or give a smaller --max-image-size or "
        "fewer "
        "--threads; the same command again goes on where it stopped");
    return kFailed;
  } catch (const std::exception& error) {
    terminal.End();
    terminal.Fail(error.what());
    return kFailed;
  }
}

}  // namespace
}  // namespace polarscan

int main(int argc, char** argv) { return polarscan::Run(argc, argv); }
