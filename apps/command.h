// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "apps/terminal/interrupt.h"
#include "apps/terminal/terminal.h"
#include "core/error.h"
#include "core/options.h"
#include "stereo/options.h"

namespace polarscan {

// What every subcommand gets beside its own options. The global flags are set before a subcommand's callback
// runs.
struct Context {
  Terminal& progress;
  std::uint64_t seed = 0;  // --seed: where a stage's options have a seed, the command sets it to this
  bool json = false;       // --json: the result goes to stdout as JSON (see Finish)
  bool data_lost = false;  // a command sets it when it is done but data was lost or damaged: exit code 3
  bool not_ready = false;  // doctor sets it when something is bad: exit code 1

  // A command's last line: with --json `result` on stdout, else `text` on stderr.
  void Finish(const nlohmann::json& result, const std::string& text) const;
};

// Adds each row of the table to the command: numbers and strings as --name VALUE with their range, bools as
// --name and --no-name. A row whose name the command already has (two stages may share one) is set together
// with the first; a row "seed" is left to the global flag. group: the heading in --help.
void AddOptions(CLI::App& command, const OptionTable& table, const std::string& group = "Options");

// The groups of options that --help-all shows, titled by who needs them.
inline constexpr const char* kInputGroup = "Input, for pictures that do not say it themselves";
inline constexpr const char* kDemosaicGroup = "Demosaicing, for raw mosaics";
inline constexpr const char* kPosesGroup = "Poses, for pictures that are hard to place, and for known poses";
inline constexpr const char* kUndistortGroup = "Undistortion, for large pictures, and depths that are known";
inline constexpr const char* kStereoGroup = "Stereo, for who trades time for detail, or studies the method";
inline constexpr const char* kFusionGroup = "Fusion, for clouds with strays, or with gaps";
inline constexpr const char* kMeshGroup = "Mesh, for another fineness, or other gaps";

// Of the options so far, --help shows these and those without a group of their own; --help-all shows the
// rest.
void ShowFirst(CLI::App& command, const std::vector<std::string>& names);

// Shown at the end of the help and in the man page: whole commands, one a line. What is wrongly used is
// answered with the first one.
void AddExample(CLI::App& command, const std::string& lines);

// What an argument must be, with words for people: a folder, a file, either.
CLI::Validator IsFolder();
CLI::Validator IsFile();
CLI::Validator IsFileOrFolder();
CLI::Validator IsBetween(int min, int max);
CLI::Validator IsBetween(double min, double max);

// {name: value} of the rows that the command line or the configuration file set: what goes on top of a
// preset.
nlohmann::json GivenOptions(const CLI::App& command, const OptionTable& table);

// Stereo's options from the command line: those of the preset that was asked for, with what else was given on
// top.
StereoOptions StereoOptionsFrom(const CLI::App& command, StereoOptions parsed, const Context& context);

// Does work that nothing is left of when it is stopped, for which it gets the time that it needs: `left` then
// says what there is instead of advice to go on.
template <class Work>
void DoWhole(const std::string& left, Work&& work) {
  EndInItsOwnTime();
  try {
    work();
  } catch (const Cancelled&) {
    throw Cancelled("stopped; " + left);
  }
}

// One function a subcommand, each in a file of its own:
//
//   void AddExampleCommand(CLI::App& app, Context& context) {
//     auto options = std::make_shared<ExampleOptions>();
//     CLI::App* command = app.add_subcommand("example", "What it does in one line");
//     AddOptions(*command, Table(*options));
//     command->callback([options, &context] { ...; context.Finish({{"points", n}}, fmt::format("{} points",
//     n)); });
//   }
//
// Errors are thrown (polarscan::Error, Cancelled); main.cpp turns them into messages and exit codes.
void AddCalibrateCommand(CLI::App& app, Context& context);
void AddCamerasCommand(CLI::App& app, Context& context);
void AddCaptureCommand(CLI::App& app, Context& context);
void AddCheckCommand(CLI::App& app, Context& context);
void AddDemosaicCommand(CLI::App& app, Context& context);
void AddDoctorCommand(CLI::App& app, Context& context);
void AddEvaluateCommand(CLI::App& app, Context& context);
void AddExportCommand(CLI::App& app, Context& context);
void AddFuseCommand(CLI::App& app, Context& context);
void AddHelpCommand(CLI::App& app, Context& context);
void AddImportCommand(CLI::App& app, Context& context);
void AddMeshCommand(CLI::App& app, Context& context);
void AddReconstructCommand(CLI::App& app, Context& context);
void AddReplayCommand(CLI::App& app, Context& context);
void AddReportCommand(CLI::App& app, Context& context);
void AddBoardCommand(CLI::App& app, Context& context);
void AddSfmCommand(CLI::App& app, Context& context);
void AddSimulateCommand(CLI::App& app, Context& context);
void AddStereoCommand(CLI::App& app, Context& context);

}  // namespace polarscan
