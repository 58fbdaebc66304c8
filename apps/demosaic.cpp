// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "acquisition/input/forms/forms.h"
#include "apps/command.h"
#include "core/error.h"
#include "core/files/files.h"
#include "pipeline/views/views.h"

namespace polarscan {
namespace fs = std::filesystem;
namespace {

struct DemosaicCommand {
  std::string input, views;
  InputOptions input_options;
  DemosaicOptions options;
  bool pictures = false;
};

// The views never lie where their pictures do.
void RequireElsewhere(const Input& input, const fs::path& views) {
  const std::string folder = (fs::weakly_canonical(views) / "").string();
  for (const InputView& view : input.views)
    for (const fs::path& file : view.files)
      if (fs::weakly_canonical(file).string().starts_with(folder))
        throw Error("the pictures themselves lie in the folder for their views", views.string(),
                    "Choose a folder beside them with -o");
}

// The views are of the same input as before, which may have been moved since.
void RequireSameInput(const DemosaicCommand& command) {
  const fs::path note = fs::path(command.views) / ".input";
  const std::string input = fs::weakly_canonical(command.input).string();
  if (fs::exists(note))
    if (const std::string before = ReadFile(note); before != input && fs::exists(before))
      throw Error(fmt::format("this folder holds the views of other pictures ({})", before), command.views,
                  "Choose another folder with -o, or remove this one");
  WriteFileAtomically(note, input);
}

void Run(const DemosaicCommand& command, Context& context) {
  const Input input = OpenInput(command.input, command.input_options, context.progress);
  RequireElsewhere(input, command.views);
  RequireFree(command.views, [&] { return IsViewFolder(command.views); });
  const bool pictures = command.pictures && input.polarized();
  if (command.pictures && !pictures)
    context.progress.Warn("plain photos have no polarization to look at: --pictures makes none");
  CreateFolder(command.views);
  const Descriptor lock = LockFolder(command.views, "folder of views");
  RequireSameInput(command);
  MakeStokesViews(input, command.views, command.options, context.progress, pictures);
  context.data_lost = input.damaged();
  context.Finish(
      {{"input", ToJson(input)}, {"views", input.views.size()}, {"folder", command.views}},
      fmt::format("{} view{} in {}{}", input.views.size(), input.views.size() == 1 ? "" : "s", command.views,
                  pictures ? fmt::format("; pictures to look at in {}",
                                         (fs::path(command.views) / "pictures").string())
                           : ""));
}

}  // namespace

void AddDemosaicCommand(CLI::App& app, Context& context) {
  auto command = std::make_shared<DemosaicCommand>();
  CLI::App* sub = app.add_subcommand("demosaic", "Turn pictures of any kind into Stokes views");
  sub->add_option("INPUT", command->input,
                  "A folder of raw mosaics, polarizer pictures, Stokes pictures or photos")
      ->required()
      ->check(IsFolder());
  sub->add_option("-o,--output", command->views, "The folder for the views")->required();
  sub->add_flag(
      "--pictures", command->pictures,
      "Also pictures/VIEW/: angle and degree of polarization, diffuse, specular, redundancy, as PNG");
  AddOptions(*sub, Table(command->input_options), kInputGroup);
  AddOptions(*sub, Table(command->options));
  ShowFirst(*sub, {"layout", "bits", "input-kind", "calibration"});
  AddExample(*sub, "  polarscan demosaic pictures -o views --layout \"90 45 / 135 0\" --pictures");
  sub->callback([command, &context] { Run(*command, context); });
}

}  // namespace polarscan
