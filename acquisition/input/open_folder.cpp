// SPDX-License-Identifier: Apache-2.0
// One INPUT folder understood (OpenInput); several of them are input.cpp's.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "acquisition/input/angles.h"
#include "acquisition/input/forms.h"
#include "acquisition/input/ignored_files.h"
#include "acquisition/input/input.h"
#include "acquisition/input/masks.h"
#include "acquisition/input/options.h"
#include "acquisition/input/shot.h"
#include "acquisition/session/session_views.h"
#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/picture_tags.h"

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

bool IsJpeg(const fs::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".jpg" || extension == ".jpeg" || extension == ".JPG" || extension == ".JPEG";
}

void AddSessionNotes(Input& input) {
  const FrameCounts& counts = input.session->info.counts;
  if (counts.lost + counts.dropped > 0) input.notes.push_back("the session: " + Describe(counts));
  for (const std::string& damage : input.session->damage)
    input.warnings.push_back("the session is damaged: " + damage);
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

void WarnOfAngles(Input& input) {
  const std::vector<double> angles = AnglesNamesMayMean(input.folder);
  if (angles.empty()) return;
  input.warnings.push_back(
      fmt::format("the folders {} may be the angles of a polarizer, and their pictures are taken as plain "
                  "photos: give {} if they are angles, --input-kind photos if not",
                  AnglesText(angles), AnglesOption(angles)));
}

void AddNotes(Input& input, const InputOptions& options, const Picture& first) {
  const auto without = std::ranges::count_if(input.views, [](const InputView& view) { return !view.mask; });
  if (without > 0 && std::size_t(without) < input.views.size())
    input.notes.push_back(fmt::format("{} of {} views have no mask; there the whole picture counts as object",
                                      without, input.views.size()));
  if (!MaskFromAlpha(first).empty())
    input.notes.push_back(without > 0 ? "what is transparent in the pictures counts as their mask"
                                      : "the pictures' transparency is not used, since there are masks");
  if (!input.polarized() && options.kind == "auto") WarnOfAngles(input);
  if (!input.polarized())
    input.notes.push_back("plain photos: no polarization is known, so stereo goes by the intensity alone");
  if (!input.views[0].exposures.empty())
    input.notes.push_back("the views were taken with several exposures, which are merged");
  if (input.session) return AddSessionNotes(input);
  if (input.polarized() && options.gamma <= 0 && IsJpeg(input.views[0].files[0]))
    input.notes.push_back("JPEG pictures are taken as linear in light (--gamma 2.2 if they are not)");
  if (input.kind == InputKind::kRgbAopDop && options.aop_sense == "auto")
    input.notes.push_back(
        "angles of polarization are taken as anticlockwise from +x (--aop-sense clockwise if they are not)");
}

// In what the angles are taken to be where nobody said it, and whether they end long before half a turn.
void SayAopScale(Input& input, const InputOptions& options) {
  if (input.kind != InputKind::kRgbAopDop || options.aop_scale != "auto") return;
  constexpr double kMostOfIt = 0.75;
  const std::size_t step = std::max<std::size_t>(1, input.views.size() / 8);
  double least = 0, most = 0, end = 0;
  bool floating = false;
  for (std::size_t i = 0; i < input.views.size(); i += step) {
    try {
      const Picture aop = ReadPicture(input.views[i].files[1]);
      floating = aop.bits == 32;
      end = floating ? std::numbers::pi : aop.full_scale;
      for (const float value : aop.planes[0].pixels())
        if (std::isfinite(value))
          least = std::min(least, double(value)), most = std::max(most, double(value));
    } catch (const Error&) {  // reading it for good will tell
    }
  }
  if (end == 0) return;
  input.notes.push_back(floating ? "angles of polarization are taken as radians (--aop-scale if they are not)"
                                 : "full scale of aop/ is taken as 180 degrees (--aop-scale if it is not)");
  if (most > kMostOfIt * end || least < 0) return;
  input.warnings.push_back(
      fmt::format("no angle in aop/ is above {:.4g} where half a turn is taken as {:.4g}: are they {}? Give "
                  "--aop-scale {}, or "
                  "{} if they are right",
                  most, end, floating ? "shares of half a turn" : "degrees",
                  floating ? "half-turn" : "degrees", floating ? "radians" : "half-turn"));
}

// Counts that are taken as linear in light though their file says that they are not, or cannot say.
void WarnOfEncoding(Input& input, const InputOptions& options, const Picture& first) {
  const bool counts = !input.session && input.kind != InputKind::kStokes && first.bits < 32;
  if (!counts || input.sensor.gamma != 1 || options.gamma > 0) return;
  const std::vector<fs::path>& files = input.views[0].files;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!ReadPictureTags(files[i]).encoded) continue;
    const bool is_light = input.kind != InputKind::kRgbAopDop || i == 0;
    return input.warnings.push_back(
        fmt::format("{} says that its values are coded for showing (sRGB, a gamma or a profile), and they "
                    "are taken as they are: {}",
                    files[i].string(),
                    is_light ? "give --gamma 2.2, or --gamma 1 if they are linear in light all the same"
                             : "angles and degrees of polarization must be saved linear"));
  }
  if (first.bits == 8 && input.kind != InputKind::kMosaic && !IsJpeg(files[0]))
    input.notes.push_back(
        "these 8-bit pictures do not say whether they are linear in light; they are taken as such (--gamma "
        "2.2 if they are not)");
}

// Views whose k-th file is one.
auto CountJpegs(const Input& input, std::size_t k) {
  return std::ranges::count_if(input.views, [k](const InputView& view) { return IsJpeg(view.files[k]); });
}

// JPEG keeps blocks of pixels, not single ones.
void WarnOfJpegMosaics(Input& input) {
  if (input.kind != InputKind::kMosaic || input.session) return;
  const auto jpegs = CountJpegs(input, 0);
  if (jpegs > 0)
    input.warnings.push_back(fmt::format(
        "{} of {} raw mosaics are JPEG, which blends neighbouring pixels, here of different polarizers: "
        "polarization is wrong or lost there. Save the camera's pictures as PNG or TIFF",
        jpegs, input.views.size()));
}

void AddWarnings(Input& input, const InputOptions& options, const Picture& first) {
  WarnOfEncoding(input, options, first);
  WarnOfJpegMosaics(input);
  SayAopScale(input, options);
  if (first.bits == 8 && options.bits > 8 && !input.session)
    input.warnings.push_back(fmt::format(
        "these pictures hold 8 bits, not {} as --bits or set.json says; they are taken as 8 bits. Save "
        "the camera's counts in 16-bit files to keep them all",
        options.bits));
  if (first.bits < 32 && input.sensor.white_dn > double((1 << input.sensor.bits) - 1))
    input.warnings.push_back(fmt::format(
        "no count of these {}-bit pictures reaches the white level {:g}, so all of them come out dark: "
        "check --white-level and set.json",
        input.sensor.bits, input.sensor.white_dn));
  if (input.kind != InputKind::kRgbAopDop) return;
  const auto jpegs = CountJpegs(input, 1);
  if (jpegs > 0)
    input.warnings.push_back(fmt::format(
        "{} of {} pictures in aop/ are JPEG, which blends 0 with 180 degrees and neighbours with each "
        "other: the angles are wrong there. Save them as PNG or TIFF",
        jpegs, input.views.size()));
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

// given: before the folder was asked.
void WarnOfUnusedLayout(Input& input, const InputOptions& given) {
  if (!given.layout.empty() && input.kind != InputKind::kMosaic)
    input.warnings.push_back(fmt::format(
        "--layout is for raw mosaics and not used: these pictures are taken as {}{}", ToString(input.kind),
        input.kind == InputKind::kPhotos ? " (--input-kind mosaic if they are raw mosaics)" : ""));
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
