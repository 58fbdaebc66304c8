// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "acquisition/session/import_export.h"
#include "apps/command.h"

namespace polarscan {
namespace {

void Import(const std::string& folder, const InputOptions& options, const std::string& session,
            Context& context) {
  const Input input = OpenInput(folder, options, context.progress);
  TellNotes(input, context.progress);
  const std::size_t frames = ImportSession(input, session, context.progress);
  context.Finish({{"session", session}, {"frames", frames}}, fmt::format("{} frames in {}", frames, session));
}

void Export(const std::string& folder, const std::string& extension, const std::string& output,
            Context& context) {
  const Session session = OpenSession(folder, Verify::kPayloads, context.progress);
  for (const std::string& text : session.damage) context.progress.Warn(text);
  context.data_lost = !session.damage.empty();
  const std::size_t files = ExportSession(session, output, extension, context.progress);
  context.Finish({{"folder", output}, {"files", files}}, fmt::format("{} pictures in {}", files, output));
}

void ExportByAngle(const std::string& folder, const InputOptions& options, const std::string& extension,
                   const std::string& output, Context& context) {
  const Input input = OpenInput(folder, options, context.progress);
  TellNotes(input, context.progress);
  const std::size_t views =
      ExportAngles(input, FindDemosaicMethod(DemosaicOptions().method), output, extension, context.progress);
  context.Finish({{"folder", output}, {"views", views}}, fmt::format("{} views in {}", views, output));
}

struct ExchangeArguments {
  std::string from, to, format = "tiff", as = "mosaic";
  InputOptions input;
};

}  // namespace

void AddImportCommand(CLI::App& app, Context& context) {
  auto a = std::make_shared<ExchangeArguments>();
  CLI::App* command = app.add_subcommand("import", "Turn raw mosaics into a session");
  command->add_option("INPUT", a->from, "Folder of raw mosaics (docs/input.md)")
      ->required()
      ->check(IsFolder());
  command->add_option("-o,--output", a->to, "The session's folder, new or empty")
      ->required()
      ->type_name("SESSION");
  AddOptions(*command, Table(a->input), kInputGroup);
  ShowFirst(*command, {"layout", "bits", "calibration"});
  AddExample(*command, "  polarscan import pictures -o session --layout \"90 45 / 135 0\"");
  command->callback(
      [a, &context] { DoWhole("nothing was imported", [&] { Import(a->from, a->input, a->to, context); }); });
}

void AddExportCommand(CLI::App& app, Context& context) {
  auto a = std::make_shared<ExchangeArguments>();
  CLI::App* command = app.add_subcommand("export", "Turn a session into 16-bit pictures, an INPUT again");
  command->add_option("SESSION", a->from, "A session")->required()->check(IsFolder());
  command->add_option("-o,--output", a->to, "The folder for pictures and set.json, new or empty")->required();
  AddOptions(*command,
             {{.name = "format", .value = &a->format, .help = "of the pictures", .choices = {"tiff", "png"}},
              {.name = "as",
               .value = &a->as,
               .help = "raw mosaics, or interpolated pictures of the four angles",
               .choices = {"mosaic", "angles"}}});
  AddOptions(*command, Table(a->input), "With --as angles, what the session does not say");
  AddExample(*command, "  polarscan export session -o pictures --format png");
  command->callback([a, &context] {
    const std::string extension = a->format == "png" ? "png" : "tif";
    DoWhole("nothing was exported", [&] {
      a->as == "angles" ? ExportByAngle(a->from, a->input, extension, a->to, context)
                        : Export(a->from, extension, a->to, context);
    });
  });
}

}  // namespace polarscan
