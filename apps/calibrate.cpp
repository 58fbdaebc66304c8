// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <ctime>

#include "acquisition/calibration_frames.h"
#include "acquisition/session/import_export.h"
#include "apps/command.h"
#include "core/files/files.h"
#include "demosaic/calibration/dark.h"
#include "demosaic/calibration/flat.h"
#include "demosaic/calibration/pictures.h"
#include "demosaic/calibration/polarizer/find_layout.h"
#include "demosaic/calibration/polarizer/polarizer.h"
#include "demosaic/calibration/polarizer/polarizer_options.h"

namespace polarscan {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

struct CalibrateArguments {
  fs::path input, output;
  InputOptions meaning;
  PolarizerOptions polarizer;
  FlatOptions flat;
  double first_angle_deg = 0;
  std::string sense = "anticlockwise", format = "tiff";
};

// The frames and the calibration that they add to: the one in the output folder, or a new one.
struct Work {
  std::shared_ptr<const Input> input;
  Calibration calibration;
};

Work Open(const CalibrateArguments& a, Context& context) {
  RequireFree(a.output, [&] { return IsCalibration(a.output); });
  InputOptions options = a.meaning;
  if (IsCalibration(a.output)) options.calibration = a.output.string();
  Work work{std::make_shared<const Input>(OpenInput(a.input, options, context.progress)), {}};
  const Input& input = *work.input;
  if (input.calibration) work.calibration = *input.calibration;
  TellNotes(input, context.progress);
  work.calibration.sensor = input.sensor;
  work.calibration.binding.camera.update(input.binding.camera);
  work.calibration.binding.settings.update(input.binding.settings);
  return work;
}

json Part(const CalibrateArguments& a, json summary) {
  summary["input"] = fs::absolute(a.input).string();
  summary["created"] = TimeNow();
  return summary;
}

// A figure of a part of a calibration, by the keys that lead to it; 0 where it was not found.
double Figure(const json& part, std::initializer_list<const char*> keys) {
  const json* value = &part;
  for (const char* key : keys) {
    if (!value->is_object() || !value->contains(key)) return 0;
    value = &value->at(key);
  }
  return value->is_number() ? value->get<double>() : 0;
}

std::string DescribeDark(const json& part) {
  return fmt::format("{} dark frames: black level {:.2f} DN, pixels +-{:.2f} DN, read noise {:.2f} DN",
                     Figure(part, {"frames"}), Figure(part, {"black_dn"}), Figure(part, {"pixel_spread_dn"}),
                     Figure(part, {"read_noise_dn"}));
}

std::string DescribeFlat(const json& part) {
  return fmt::format(
      "{} pairs of flat frames: {:.4g} DN per electron, read noise {:.2f} e-, pixels' gains +-{:.2f} %",
      Figure(part, {"pairs"}), Figure(part, {"dn_per_e"}), Figure(part, {"read_noise_e"}),
      100 * Figure(part, {"gain_spread"}));
}

// How well one pixel is known; earlier calibrations do not say.
std::string DescribeUncertainty(const json& part) {
  if (!part.contains("uncertainty")) return "";
  return fmt::format(" (those of one pixel are known to {:.4f} and {:.2f} degrees)",
                     Figure(part, {"uncertainty", "diattenuation"}),
                     Figure(part, {"uncertainty", "angle_deg"}));
}

std::string DescribeDoubts(const json& part) {
  std::string text;
  for (const json& doubt : part.value("doubtful_frames", json::array()))
    text += fmt::format("{} {}", text.empty() ? "; frames that do not fit the others:" : ",",
                        doubt.value("frame", "?"));
  return text;
}

std::string DescribePolarizer(const json& part) {
  const double zero_deg = Figure(part, {"zero_deg"});
  return fmt::format(
      "{} frames: gain +-{:.2f} %, diattenuation {:.3f} +-{:.3f}, angle {:+.2f} +-{:.2f} degrees{}, "
      "condition "
      "{:.2f}, residual {:.2f} % of full scale, {} defect pixels{}{}",
      Figure(part, {"frames"}), 100 * Figure(part, {"gain", "spread"}),
      Figure(part, {"diattenuation", "median"}), Figure(part, {"diattenuation", "spread"}),
      Figure(part, {"angle_error_deg", "median"}), Figure(part, {"angle_error_deg", "spread"}),
      DescribeUncertainty(part), Figure(part, {"condition", "median"}),
      100 * Figure(part, {"residual", "median"}), Figure(part, {"defect_pixels"}),
      std::abs(zero_deg) > 0.05
          ? fmt::format("; the given angles' zero lies {:+.2f} degrees from the sensor's", zero_deg)
          : "",
      DescribeDoubts(part));
}

std::string DescribePart(const std::string& name, const json& part) {
  return name == "dark" ? DescribeDark(part) : name == "flat" ? DescribeFlat(part) : DescribePolarizer(part);
}

void Finish(const CalibrateArguments& a, Calibration& calibration, const std::string& part,
            Context& context) {
  const std::string text = DescribePart(part, calibration.parts[part]);
  WriteCalibration(a.output, calibration);
  context.Finish({{"calibration", a.output.string()},
                  {"hash", calibration.hash},
                  {"binding", HashOf(calibration.binding)},
                  {part, calibration.parts[part]}},
                 fmt::format("{}; in {}", text, a.output.string()));
}

void RunDark(const CalibrateArguments& a, Context& context) {
  Work work = Open(a, context);
  Calibration& calibration = work.calibration;
  DarkCalibration dark = CalibrateDark(FramesOf(work.input, true), calibration.sensor, context.progress);
  for (const char* later : {"flat", "polarizer"})
    if (calibration.parts.contains(later))
      context.progress.Warn(
          fmt::format("what {} frames told is forgotten, since it rested on the old black level: "
                      "run polarscan calibrate {} again",
                      later, later));
  if (double(dark.at_zero) > 0.01 * double(dark.black_dn.size()) * dark.frames)
    context.progress.Warn(
        "many samples are cut off at 0, so the black level comes out too high; raise the "
        "camera's black level");
  calibration.parts = {{"dark", Part(a, Summary(dark))}};
  calibration.correction = {std::move(dark.black_dn), {}};
  calibration.sensor.black_dn = dark.mean_dn;
  if (calibration.sensor.dn_per_e > 0)
    calibration.sensor.read_noise_e = dark.read_noise_dn / calibration.sensor.dn_per_e;
  Finish(a, calibration, "dark", context);
}

void WarnWithoutDark(const Calibration& calibration, Context& context) {
  if (!calibration.parts.contains("dark"))
    context.progress.Warn(
        fmt::format("no dark frames have been calibrated in this folder; the black level is taken "
                    "as {:g} DN everywhere",
                    calibration.sensor.black_dn));
}

void RunFlat(const CalibrateArguments& a, Context& context) {
  Work work = Open(a, context);
  Calibration& calibration = work.calibration;
  WarnWithoutDark(calibration, context);
  const double read_noise_dn =
      calibration.parts.contains("dark") ? calibration.parts["dark"]["read_noise_dn"].get<double>() : -1;
  FlatCalibration flat =
      CalibrateFlat(FramesOf(work.input, true), calibration.sensor, calibration.correction.black_dn,
                    read_noise_dn, a.flat, context.progress);
  calibration.parts["flat"] = Part(a, Summary(flat, calibration.sensor));
  calibration.sensor.dn_per_e = flat.all.dn_per_e;
  calibration.sensor.read_noise_e = flat.all.dn_per_e > 0 ? flat.all.read_noise_dn / flat.all.dn_per_e : 0;
  if (!calibration.parts.contains("polarizer")) calibration.correction.responses = std::move(flat.responses);
  Finish(a, calibration, "flat", context);
}

void RunPolarizer(const CalibrateArguments& a, Context& context) {
  Work work = Open(a, context);
  Calibration& calibration = work.calibration;
  WarnWithoutDark(calibration, context);
  const CalibrationFrames frames = FramesOf(work.input, false);
  PolarizerCalibration found =
      CalibratePolarizer(frames, calibration.sensor, calibration.correction.black_dn,
                         KnowledgeOf(a.polarizer, frames.names), a.polarizer.shading, context.progress);
  CreateFolder(a.output);
  json summary = Summary(found, calibration.sensor.layout);
  summary["pictures"] = WriteCalibrationPictures(a.output, found, calibration.sensor.layout);
  PolarizerOptions effective = a.polarizer;
  summary["options"] = ToJson(Table(effective));
  calibration.parts["polarizer"] = Part(a, std::move(summary));
  calibration.correction.responses = std::move(found.responses);
  Finish(a, calibration, "polarizer", context);
}

void RunLayout(const CalibrateArguments& a, Context& context) {
  InputOptions options = a.meaning;
  const std::string said = options.layout;
  if (said.empty()) options.layout = ToString(Layout());  // any: it is what we look for
  const auto input = std::make_shared<const Input>(OpenInput(a.input, options, context.progress));
  const FoundLayout found = FindLayout(MeanCells(FramesOf(input, false), input->sensor, context.progress),
                                       a.first_angle_deg, a.sense == "anticlockwise");
  Layout layout = found.layout;
  layout.bayer = input->sensor.layout.bayer;
  if (layout != input->sensor.layout && (!said.empty() || input->session))
    context.progress.Warn("this is not the layout that was said, " + ToString(input->sensor.layout));
  context.Finish(
      {{"layout", ToString(layout)},
       {"angles_deg", found.angles_deg},
       {"turn_deg", found.turn_deg},
       {"first_error_deg", found.first_error_deg}},
      fmt::format("the layout is \"{}\" (the polarizer turned by {:+.0f} degrees; its first angle is off by "
                  "{:+.1f})",
                  ToString(layout), found.turn_deg, found.first_error_deg));
}

void RunApply(const CalibrateArguments& a, Context& context) {
  const Input input = OpenInput(a.input, a.meaning, context.progress);
  TellNotes(input, context.progress);
  const std::size_t views =
      ExportCorrected(input, a.output, a.format == "png" ? "png" : "tif", context.progress);
  context.Finish({{"folder", a.output.string()}, {"views", views}},
                 fmt::format("{} corrected mosaics in {}", views, a.output.string()));
}

// "Gain 3, width 128": without the quotes of JSON.
std::string ListText(const json& values) {
  std::string text;
  for (const auto& [name, value] : values.items())
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name,
                        value.is_string() ? value.get<std::string>() : ToText(value));
  return text.empty() ? "not said" : text;
}

void RunShow(const CalibrateArguments& a, Context& context) {
  const Calibration c = ReadCalibration(a.input);
  std::string text =
      fmt::format("camera:    {}\nsettings:  {}\n", ListText(c.binding.camera), ListText(c.binding.settings));
  text += fmt::format("sensor:    layout {}, {} bits, black level {:.2f} DN, white level {:g} DN",
                      ToString(c.sensor.layout), c.sensor.bits, c.sensor.black_dn, c.sensor.white_dn);
  if (c.sensor.dn_per_e > 0)
    text += fmt::format(" ({:.0f} electrons), noise without light {:.2f} e-",
                        c.sensor.RangeDn() / c.sensor.dn_per_e, c.sensor.read_noise_e);
  for (const char* name : {"dark", "flat", "polarizer"})
    text += fmt::format(
        "\n{:<11}{}", std::string(name) + ":",
        c.parts.contains(name)
            ? fmt::format("{} ({})", DescribePart(name, c.parts[name]), c.parts[name].value("created", "?"))
            : fmt::format("not measured; polarscan calibrate {} does", name));
  context.Finish({{"camera", c.binding.camera},
                  {"settings", c.binding.settings},
                  {"sensor", ToJson(c.sensor)},
                  {"parts", c.parts},
                  {"hash", c.hash}},
                 text);
}

// What every kind of frames needs beside the input's own options; a calibration is what comes out.
OptionTable FramesTable(InputOptions& options) {
  OptionTable table = Table(options);
  std::erase_if(table, [](const Option& row) {
    return row.name == "calibration" || row.name == "aop-sense" || row.name == "aop-scale" ||
           row.name == "gamma" || row.name == "angles";
  });
  return table;
}

using Step = void (*)(const CalibrateArguments&, Context&);

CLI::App* AddStep(CLI::App& parent, const char* name, const char* help,
                  const std::shared_ptr<CalibrateArguments>& a, Step step, Context& context) {
  CLI::App* command = parent.add_subcommand(name, help);
  command->add_option("INPUT", a->input, "A session, or a folder of raw mosaics (docs/input.md)")
      ->required()
      ->check(IsFolder());
  command->callback([a, step, &context] { DoWhole("nothing was written", [&] { step(*a, context); }); });
  return command;
}

void AddOutput(CLI::App& command, CalibrateArguments& a) {
  command.add_option("-o,--output", a.output, "The calibration's folder: a new one, or one to add to")
      ->required()
      ->type_name("CALIBRATION");
}

}  // namespace

void AddCalibrateCommand(CLI::App& app, Context& context) {
  CLI::App* calibrate = app.add_subcommand(
      "calibrate", "What is true of this one camera: black level, gain, polarizers (docs/calibration.md)");
  calibrate->require_subcommand(1);
  AddExample(*calibrate,
             "  polarscan calibrate dark dark-frames -o calibration\n"
             "  polarscan calibrate polarizer turned-frames -o calibration");

  auto a = std::make_shared<CalibrateArguments>();
  CLI::App* dark = AddStep(*calibrate, "dark", "Black level of every pixel and read noise, from dark frames",
                           a, RunDark, context);
  AddExample(*dark, "  polarscan calibrate dark dark-frames -o calibration");
  AddOutput(*dark, *a);
  AddOptions(*dark, FramesTable(a->meaning), kInputGroup);

  CLI::App* flat =
      AddStep(*calibrate, "flat", "Gain and noise, from pairs of frames of even light", a, RunFlat, context);
  AddExample(*flat, "  polarscan calibrate flat flat-frames -o calibration");
  AddOutput(*flat, *a);
  flat->add_flag("--unpolarized", a->flat.unpolarized,
                 "The light is known to be unpolarized: what differs between the angles is gain");
  AddOptions(*flat, FramesTable(a->meaning), kInputGroup);

  CLI::App* polarizer =
      AddStep(*calibrate, "polarizer",
              "Response of every pixel, from a linear polarizer turned in front of even light", a,
              RunPolarizer, context);
  AddExample(*polarizer, "  polarscan calibrate polarizer turned-frames -o calibration");
  AddOutput(*polarizer, *a);
  AddOptions(*polarizer, Table(a->polarizer));
  AddOptions(*polarizer, FramesTable(a->meaning), kInputGroup);

  CLI::App* layout = AddStep(*calibrate, "layout",
                             "Find the layout from a linear polarizer turned in one sense, frames in order",
                             a, RunLayout, context);
  AddExample(*layout, "  polarscan calibrate layout turned-frames --sense clockwise");
  AddOptions(*layout, {{.name = "first-angle",
                        .value = &a->first_angle_deg,
                        .help = "of the first frame's polarizer; 0: it passes horizontal light",
                        .unit = "deg",
                        .min = -360,
                        .max = 360},
                       {.name = "sense",
                        .value = &a->sense,
                        .help = "in which it is turned, as seen from the camera",
                        .choices = {"anticlockwise", "clockwise"}}});
  AddOptions(*layout, FramesTable(a->meaning), kInputGroup);

  CLI::App* apply =
      AddStep(*calibrate, "apply", "Write corrected mosaics, an INPUT again", a, RunApply, context);
  AddExample(*apply, "  polarscan calibrate apply session -o corrected --calibration calibration");
  apply->add_option("-o,--output", a->output, "The folder for them, new or empty")->required();
  AddOptions(
      *apply,
      {{.name = "format", .value = &a->format, .help = "of the pictures", .choices = {"tiff", "png"}}});
  AddOptions(*apply, Table(a->meaning), kInputGroup);

  CLI::App* show = calibrate->add_subcommand("show", "What a calibration is for and what it knows");
  show->add_option("CALIBRATION", a->input, "Its folder")->required()->check(IsFolder());
  AddExample(*show, "  polarscan calibrate show calibration");
  show->callback([a, &context] { RunShow(*a, context); });
}

}  // namespace polarscan
