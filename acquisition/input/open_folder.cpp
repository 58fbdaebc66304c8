// SPDX-License-Identifier: Apache-2.0
// One INPUT folder understood (OpenInput); several of them are input.cpp's.
#include <fmt/format.h>

#include <algorithm>

#include "acquisition/input/forms/angles.h"
#include "acquisition/input/forms/forms.h"
#include "acquisition/input/ignored_files.h"
#include "acquisition/input/input.h"
#include "acquisition/input/masks.h"
#include "acquisition/input/options.h"
#include "acquisition/input/remarks.h"
#include "acquisition/input/shot.h"
#include "acquisition/session/session_views.h"
#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

void RequireFolder(const fs::path& folder) {
  if (!fs::exists(folder)) throw Error("there is no such folder", folder.string(), "Is the path right?");
  if (!fs::is_directory(folder))
    throw Error("a folder with pictures was expected, this is a file", folder.string());
}

// file_bits: of a sample in the files.
Layout MosaicLayout(const Input& input, const InputOptions& options, int file_bits) {
  const bool asks_bits = file_bits == 16 && options.bits == 0;
  if (options.layout.empty())
    throw Error(
        fmt::format("the layout of these raw mosaics is not known{}",
                    asks_bits ? ", nor how many of the 16 bits they use" : ""),
        input.folder.string(),
        fmt::format(
            "Give the polarizer angles of the 2x2 cell from the top-left pixel, as in --layout \"90 45 "
            "/ 135 0\" (most Sony sensors), or \"layout\" under \"sensor\" in set.json{}",
            asks_bits ? "; and --bits 12 (or 10, 14, 16), or \"bits\" there" : ""));
  return ParseLayout(options.layout);
}

bool UsesMoreThan14Bits(const Picture& picture) {
  return std::ranges::any_of(
      picture.planes, [](const auto& plane) { return *std::ranges::max_element(plane.pixels()) > 16383; });
}

// No common sensor has 15 bits, so a count that needs them shows that all 16 are used.
bool ProvenToUse16Bits(const Input& input) {
  const std::size_t step = std::max<std::size_t>(1, input.views.size() / 8);
  for (std::size_t i = 0; i < input.views.size(); i += step)
    for (const fs::path& file : input.views[i].files)
      if (UsesMoreThan14Bits(ReadPicture(file))) return true;
  return false;
}

// Bits of a sample where the files have 16 of them.
int BitsOf16(Input& input, const InputOptions& options) {
  if (options.bits > 0) return options.bits;
  const bool sensor_counts = input.kind == InputKind::kMosaic;  // 12 bits moved to the upper end look like 16
  const bool counts = sensor_counts || input.kind == InputKind::kAngles;
  if (options.white_level > 0 || !counts) return 16;
  if (sensor_counts || !ProvenToUse16Bits(input))
    throw Error("how many of the 16 bits these pictures use is not known", input.folder.string(),
                "Give --bits 12 (or 10, 14, 16), or \"bits\" under \"sensor\" in set.json");
  input.notes.push_back(
      "some 16-bit samples need more than 14 bits, so all 16 are taken as used (--bits to change)");
  return 16;
}

// What the first picture says about depth, under what the options say.
void SetSensor(Input& input, const InputOptions& options, const Picture& first) {
  Sensor& sensor = input.sensor;
  if (input.kind == InputKind::kMosaic) sensor.layout = MosaicLayout(input, options, first.bits);
  sensor.bits = first.bits == 16 ? BitsOf16(input, options) : first.bits;
  if (first.bits == 8 && options.bits > 0) sensor.bits = std::min(8, options.bits);
  const bool floating = first.bits == 32;
  sensor.white_dn = options.white_level > 0 ? options.white_level
                    : floating              ? 1
                                            : double((1 << sensor.bits) - 1);
  sensor.clips = !floating || options.white_level > 0;
  sensor.black_dn = std::max(0.0, options.black_level);
  sensor.dn_per_e = options.gain;
  sensor.read_noise_e = std::max(0.0, options.read_noise);
  const bool encoded = input.kind == InputKind::kPhotos && first.bits == 8;
  sensor.gamma = options.gamma > 0 ? options.gamma : encoded ? 2.2 : 1;
  if (sensor.RangeDn() <= 0)
    throw Error(
        fmt::format("the black level {} is not below the white level {}", sensor.black_dn, sensor.white_dn),
        input.folder.string(), "Check --black-level, --white-level and --bits");
}

// Of some of the pictures' samples; what cannot be read shows when it is its turn.
std::vector<std::uint64_t> SomeCounts(const Input& input, const Progress& progress) {
  const std::size_t step = std::max<std::size_t>(1, input.views.size() / 8);
  std::vector<std::uint64_t> histogram;
  for (std::size_t i = 0; i < input.views.size(); i += step) {
    progress.Check();
    try {
      for (const Picture& picture : ReadView(input, int(i)).pictures)
        for (const Image<float>& plane : picture.planes) AddToHistogram(plane, histogram);
    } catch (const Error&) {
    }
  }
  return histogram;
}

// Where nobody says it, the pictures show at which count the sensor saturates.
void FindSaturation(Input& input, const InputOptions& options, const Progress& progress) {
  const bool counts = input.kind == InputKind::kMosaic || input.kind == InputKind::kAngles;
  if (!counts || options.white_level > 0 || !input.sensor.clips) return;
  const double end = input.sensor.white_dn,
               level = SaturationLevel(SomeCounts(input, progress), input.sensor);
  if (level >= end) return;
  input.sensor.white_dn = level;
  input.notes.push_back(
      fmt::format("the brightest samples pile up at {:g} of {:g}: they are taken as clipped, and that as the "
                  "white level (--white-level {:g} to take them as they are)",
                  level, end, end));
}

Picture FirstPicture(const Input& input) {
  const InputView& view = input.views[0];
  if (view.files.size() > 1) return ReadPicture(view.files[0]);
  std::vector<double> exposures;
  return ReadPictures(input, view, exposures)[0];
}

// Damaged frames are left out here, so that what is whole can be used.
void OpenSessionInput(Input& input, Progress& progress) {
  input.kind = InputKind::kMosaic;
  input.session = std::make_shared<Session>(OpenSession(input.folder, Verify::kPayloads, progress));
  for (const SessionView& view : ViewsOf(*input.session))
    input.views.push_back({view.name, {}, std::nullopt, view.frames, ExposuresOf(*input.session, view)});
  if (input.views.empty()) throw Error("there are no whole frames in this session", input.folder.string());
}

// A scan's folder holds pictures, too, but those of others are meant.
void RequireNoScan(const fs::path& folder) {
  const fs::path file = folder / "scan.json";
  if (!fs::exists(file)) return;
  std::string input;
  try {
    input = ReadJson(file).value("input", "");
  } catch (const std::exception&) {  // damaged: it is a scan all the same
  }
  throw Error(fmt::format("this is a scan{}, no folder of pictures", input.empty() ? "" : " of " + input),
              folder.string(), input.empty() ? "Give the folder of its pictures" : "Give " + input);
}

void SetCalibration(Input& input, std::shared_ptr<const Calibration> calibration) {
  if (input.kind != InputKind::kMosaic) {
    if (calibration)
      throw Error("only raw mosaics can be calibrated", input.folder.string(), "Leave --calibration out");
    return;
  }
  input.binding = BindingOf(input);
  if (!calibration) return;
  RequireSame(calibration->binding, input.binding,
              fmt::format("{} with {}", input.folder.string(), calibration->folder.string()));
  if (input.sensor.gamma != 1) throw Error("a calibration needs counts that are linear in light", "--gamma");
  if (!input.binding.camera.contains("serial") || !calibration->binding.camera.contains("serial"))
    input.notes.push_back(
        "whether the calibration is this camera's cannot be told: the pictures or the calibration do not say "
        "a serial number (\"camera\": {\"serial\": ...} in set.json)");
  input.calibration = std::move(calibration);
}

// The views, their masks, and what else the folder and its files say before they are read.
void LookInto(Input& input, const InputOptions& options, Progress& progress) {
  const fs::path& folder = input.folder;
  if (IsSession(folder)) {
    OpenSessionInput(input, progress);
  } else {
    input.kind = RecognizeKind(folder, options);
    FindViews(options.angles, input);
  }
  input.warnings = MisspelledKeys(folder);
  FindMasks(input);
  if (!input.session && !IsViewFolder(folder)) {
    for (const std::string& odd : Untaken(folder, input.views)) input.warnings.push_back(odd);
    for (const std::string& odd : Differences(input)) input.warnings.push_back(odd);
  }
  if (fs::is_directory(folder / "sparse")) input.known_model = folder / "sparse";
}

void SetAngleMeaning(Input& input, const InputOptions& options) {
  input.clockwise = options.aop_sense == "clockwise";
  if (input.clockwise && input.kind == InputKind::kMosaic)
    throw Error("a mosaic's sense of angles is its layout", "--aop-sense clockwise",
                "Swap 45 and 135 in --layout");
  input.aop_scale = options.aop_scale;
}

void SetSize(Input& input, const Picture& first) {
  input.width = first.width(), input.height = first.height();
  if (input.kind == InputKind::kMosaic && (input.width % 2 != 0 || input.height % 2 != 0))
    throw Error(fmt::format("a mosaic of {}x{} pixels does not consist of whole 2x2 cells", input.width,
                            input.height),
                input.folder.string(),
                "Cut the last column or row off, or give --input-kind photos if it is none");
}

}  // namespace

Input OpenInput(const fs::path& folder, const InputOptions& given) {
  Progress silent;
  return OpenInput(folder, given, silent);
}

Input OpenInput(const fs::path& folder, const InputOptions& given, Progress& progress) {
  RequireFolder(folder);
  RequireNoScan(folder);
  std::shared_ptr<const Calibration> calibration = FindCalibration(given, folder);
  const InputOptions options = WithCalibratedSensor(
      WithSetJson(WithCalibratedNoise(given, calibration.get()), folder), calibration.get());
  Input input;
  input.folder = folder;
  LookInto(input, options, progress);
  SetAngleMeaning(input, options);
  const Picture first = FirstPicture(input);
  SetSize(input, first);
  SetSensor(input, options, first);
  FindSaturation(input, options, progress);
  SetCalibration(input, std::move(calibration));
  AddNotes(input, options, first);
  AddWarnings(input, options, first);
  WarnOfUnusedLayout(input, given);
  ReadView(input, 0);  // what does not fit together should show now
  return input;
}

}  // namespace polarscan
