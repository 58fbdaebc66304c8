// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <limits>
#include <new>
#include <optional>

#include "apps/command.h"
#include "apps/terminal/config_file.h"
#include "apps/terminal/interrupt.h"
#include "apps/terminal/memory_limit.h"
#include "apps/words/help_text.h"
#include "apps/words/usage.h"
#include "core/error.h"
#include "core/files/files.h"
#include "core/words.h"

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
      ->check(IsBetween(0, 4096))
      ->capture_default_str();
  app.add_option("--seed", context.seed, "Seed of all random numbers: the same seed gives the same bytes")
      ->check(IsBetween(0, std::numeric_limits<int>::max()))
      ->capture_default_str();
  CLI::Option* verbose = app.add_flag("-v,--verbose", options.verbose, "Say more");
  app.add_flag("-q,--quiet", options.quiet, "Only warnings, errors and the result")->excludes(verbose);
  app.set_config("--config", "", "A TOML file: options by name, those of a command below its [section]")
      ->type_name("FILE.toml");
  app.set_version_flag("--version", "polarscan " POLARSCAN_VERSION, "Print the version and exit");
  AddExample(app,
             "  polarscan simulate -o pictures            pictures of a made-up scene\n"
             "  polarscan reconstruct pictures -o scan    a cloud, a mesh and a report of them\n"
             "  polarscan reconstruct --help              what else it can do\n"
             "  polarscan reconstruct pictures -o scan --config settings.toml\n\n"
             "settings.toml, with the options of the program and of any command:\n"
             "  threads = 4\n"
             "  [reconstruct]\n"
             "  preset = \"fast\"\n"
             "  max-image-size = 1200\n"
             "  mesh = false");
}

void AddCommands(CLI::App& app, Context& context) {
  AddDoctorCommand(app, context);
  AddSimulateCommand(app, context);
  AddCamerasCommand(app, context);
  AddBoardCommand(app, context);
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

// What is said of an error; those that are none of ours never reach a user as they are.
std::string WordsFor(const std::exception& error) {
  if (dynamic_cast<const Error*>(&error) || dynamic_cast<const Cancelled*>(&error)) return error.what();
  if (dynamic_cast<const std::bad_alloc*>(&error))
    return "there is not enough memory for this: close other programs, or give a smaller --max-image-size or "
           "fewer --threads; the same command again goes on where it stopped";
  if (const auto* of_files = dynamic_cast<const std::filesystem::filesystem_error*>(&error))
    return Error("the system refuses this", of_files->path1().string(), of_files->code().message()).what();
  if (dynamic_cast<const nlohmann::json::exception*>(&error))
    return fmt::format(
        "a JSON file holds something else than polarscan writes: it was changed, or another program's. "
        "polarscan check FOLDER says which (what was noticed: {})",
        JsonReason(error.what()));
  return fmt::format("this is a fault of polarscan and not yours; please report it with your command: {}",
                     error.what());
}

// An error, where people see it and, with --json, where programs do.
int Fail(Terminal& terminal, bool as_json, ExitCode code, const char* kind, const std::string& message,
         const Error* error = nullptr) {
  terminal.End();
  terminal.Fail(message);
  nlohmann::json said = {{"kind", kind}, {"message", message}, {"exit_code", int(code)}};
  if (error)
    said.update({{"what", error->happened()}, {"where", error->where()}, {"advice", error->advice()}});
  if (as_json) std::cout << ToText({{"error", said}}, 2) << std::endl;
  return code;
}

int Run(int argc, char** argv) {
  Terminal terminal;
  Context context{terminal};
  GlobalOptions options;
  std::optional<tbb::global_control> threads;

  const bool as_json = std::any_of(argv, argv + argc, [](std::string_view word) { return word == "--json"; });

  CLI::App app("polarscan turns a polarization camera into a 3D scanner", "polarscan");
  app.require_subcommand(1);
  app.fallthrough();
  app.formatter(std::make_shared<HelpText>());
  app.set_help_flag("-h,--help", "Print the help and exit");
  app.set_help_all_flag("--help-all", "Print the help with every option and exit");
  const auto config = std::make_shared<ConfigFile>(app);
  app.config_formatter(config);
  AddGlobalOptions(app, options, context);
  AddCommands(app, context);
  app.parse_complete_callback([&] {
    using Level = Terminal::Level;
    terminal.SetLevel(options.quiet ? Level::kQuiet : options.verbose ? Level::kVerbose : Level::kNormal);
    if (options.threads > 0)
      threads.emplace(tbb::global_control::max_allowed_parallelism, std::size_t(options.threads));
  });

  const StopOnInterrupt interrupts(terminal);
  ReturnFreedMemory();
  LimitMemory();
  try {
    app.parse(argc, argv);
    return context.data_lost ? kDataLost : context.not_ready ? kFailed : kDone;
  } catch (const CLI::Success& help) {
    app.exit(help);
    return kDone;
  } catch (const CLI::ParseError& error) {
    return Fail(terminal, as_json, kWrongUsage, "wrong usage", WhatIsWrong(app, error, *config));
  } catch (const Cancelled& stopped) {
    return Fail(terminal, as_json, kFailed, "stopped", stopped.what());
  } catch (const std::exception& error) {
    return Fail(terminal, as_json, kFailed, "failed", WordsFor(error), dynamic_cast<const Error*>(&error));
  }
}

}  // namespace
}  // namespace polarscan

int main(int argc, char** argv) {
  polarscan::AvoidBlasThreads(argv);
  const int code = polarscan::Run(argc, argv);
  if (std::cout.flush()) return code;
  std::cerr
      << "polarscan: standard output takes no more (a full disk, or a program that ended): what was to be "
         "written there is cut off\n";
  return code == polarscan::kDone ? polarscan::kFailed : code;
}
