// SPDX-License-Identifier: Apache-2.0
#include "acquisition/input/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "acquisition/session/session_views.h"
#include "core/error.h"
#include "core/files/files.h"
#include "core/words.h"

namespace polarscan {
namespace {

using nlohmann::json;

constexpr double infinity = std::numeric_limits<double>::infinity();
// What levels, gains and gammas can be, of any camera: beyond, a digit slipped.
constexpr double kMostDn = 1e9, kMostElectrons = 1e9, kMostGain = 1e6, kLeastGamma = 0.2, kMostGamma = 10;

// Reads keys of set.json; a value of the wrong type, or beyond its range, is an error that names the key.
class Reader {
 public:
  Reader(const json& object, std::filesystem::path path) : object_(object), path_(std::move(path)) {}

  std::optional<double> Number(const char* key, double min = -infinity, double max = infinity) const {
    if (!Has(key)) return std::nullopt;
    if (!object_[key].is_number()) Fail(key, "a number");
    const double value = object_[key].get<double>();
    if (!(value >= min && value <= max)) Fail(key, fmt::format("a number from {:g} to {:g}", min, max));
    return value;
  }
  std::optional<int> Bits(const char* key) const {
    const std::optional<double> bits = Number(key);
    if (!bits) return std::nullopt;
    if (!(*bits >= 1 && *bits <= 32) || *bits != std::floor(*bits)) Fail(key, "a whole number from 1 to 32");
    return int(*bits);
  }
  std::optional<std::string> Text(const char* key) const {
    if (!Has(key)) return std::nullopt;
    if (!object_[key].is_string()) Fail(key, "text");
    return object_[key].get<std::string>();
  }

 private:
  bool Has(const char* key) const { return object_.contains(key) && !object_[key].is_null(); }
  [[noreturn]] void Fail(const char* key, const std::string& wanted) const {
    throw Error(fmt::format("\"{}\" must be {}", key, wanted), path_.string());
  }
  const json& object_;
  std::filesystem::path path_;
};

// The count at which the sensor saturates: its full well or the end of its counts, whichever comes first;
// nothing where that is only the end of its bits.
std::optional<double> WhiteLevel(const Reader& sensor, int bits) {
  if (const auto white = sensor.Number("white_dn", 0, kMostDn)) return white;
  const auto highest = sensor.Number("max_dn", 0, kMostDn),
             well = sensor.Number("full_well_e", 0, kMostElectrons);
  const auto gain = sensor.Number("dn_per_e", 0, kMostGain);
  if ((!well || !gain) && highest == std::ldexp(1.0, bits) - 1) return std::nullopt;
  if (!well || !gain) return highest;
  const double full = std::floor(sensor.Number("black_dn").value_or(0) + *well * *gain + 1e-6);
  return highest ? std::min(*highest, full) : full;
}

void FillFromSensor(const Reader& sensor, InputOptions& options) {
  if (options.layout.empty()) {
    const std::string layout = sensor.Text("layout").value_or("");
    options.layout = layout.substr(0, layout.find('('));  // a remark in brackets may follow
  }
  if (options.bits == 0) options.bits = sensor.Bits("bits").value_or(0);
  if (options.black_level < 0) options.black_level = sensor.Number("black_dn", 0, 65535).value_or(-1);
  if (options.white_level <= 0) options.white_level = WhiteLevel(sensor, options.bits).value_or(0);
  if (options.gain <= 0) options.gain = sensor.Number("dn_per_e", 0, kMostGain).value_or(0);
  if (options.read_noise < 0) options.read_noise = sensor.Number("read_noise_e", 0, kMostGain).value_or(-1);
  if (options.gamma <= 0) options.gamma = sensor.Number("gamma", kLeastGamma, kMostGamma).value_or(0);
}

void FillFromSet(const Reader& set, InputOptions& options) {
  if (options.kind == "auto") options.kind = set.Text("input_kind").value_or("auto");
  if (options.gamma <= 0) options.gamma = set.Number("gamma", kLeastGamma, kMostGamma).value_or(0);
  if (options.aop_sense == "auto") options.aop_sense = set.Text("aop_sense").value_or("auto");
  if (options.aop_scale == "auto") options.aop_scale = set.Text("aop_scale").value_or("auto");
  if (options.angles.empty()) options.angles = set.Text("angles").value_or("");
}

// session.json or set.json; an empty object if there is neither.
json JsonOf(const std::filesystem::path& folder) {
  for (const char* name : {"session.json", "set.json"})
    if (std::filesystem::exists(folder / name)) {
      const json value = ReadJson(folder / name);
      return value.is_object() ? value : json::object();
    }
  return json::object();
}

}  // namespace

OptionTable Table(InputOptions& o) {
  const std::string layout =
      "Polarizer angles of the 2x2 cell from the top-left pixel, anticlockwise from +x, as \"90 45 / 135 "
      "0\"; colour sensors: with the Bayer order, as \"90 45 / 135 0 rggb\"";
  return {
      {.name = "input-kind",
       .value = &o.kind,
       .help = "What the pictures are, where the folders do not tell",
       .choices = {"auto", "mosaic", "angles", "stokes", "rgb-aop-dop", "photos"}},
      {.name = "layout", .value = &o.layout, .help = layout},
      {.name = "bits",
       .value = &o.bits,
       .help = "Bits of a sample, for 16-bit files that hold fewer; 0: not said",
       .min = 0,
       .max = 16},
      {.name = "black-level",
       .value = &o.black_level,
       .help = "Count without light; -1: as set.json says, else 0",
       .unit = "DN",
       .min = -1,
       .max = 65535},
      {.name = "white-level",
       .value = &o.white_level,
       .help =
           "Count at which samples are clipped; 0: as set.json says, else where samples pile up at the top, "
           "else the end of the bits",
       .unit = "DN",
       .min = 0,
       .max = 1e9},
      {.name = "gain",
       .value = &o.gain,
       .help = "Counts per electron, for the noise; 0: as set.json says, else noise is estimated from the "
               "pictures",
       .unit = "DN/e-",
       .min = 0,
       .max = 1e6},
      {.name = "read-noise",
       .value = &o.read_noise,
       .help = "Read noise; -1: as set.json says, else 0",
       .unit = "e-",
       .min = -1,
       .max = 1e6},
      {.name = "gamma",
       .value = &o.gamma,
       .help = "Light = count^gamma, 1: linear; 0: as set.json says, else 2.2 for 8-bit photos and 1 for all "
               "others",
       .min = 0,
       .max = 10},
      {.name = "aop-sense",
       .value = &o.aop_sense,
       .help = "How the source counts angles of polarization as displayed; auto: as set.json says, else "
               "anticlockwise. A mosaic's sense is its layout",
       .choices = {"auto", "anticlockwise", "clockwise"}},
      {.name = "aop-scale",
       .value = &o.aop_scale,
       .help =
           "Values in aop/: half-turn (full scale = 180 degrees), degrees, radians; auto: as set.json says, "
           "else half-turn for 8 and 16 bits, radians for floating point",
       .choices = {"auto", "half-turn", "degrees", "radians"}},
      {.name = "angles",
       .value = &o.angles,
       .help = "Polarizer's angles of the pictures behind one, three or more, as \"0,60,120\"; empty: as "
               "set.json says, else as folders and files are named",
       .unit = "deg"},
      {.name = "calibration",
       .value = &o.calibration,
       .help = "Folder made by polarscan calibrate for this camera and its settings: corrects every pixel of "
               "raw mosaics; empty: as set.json says, else none"},
  };
}

std::shared_ptr<const Calibration> FindCalibration(const InputOptions& options,
                                                   const std::filesystem::path& folder) {
  std::filesystem::path path = options.calibration;
  if (path.empty()) {
    const json set = JsonOf(folder);
    if (!set.contains("sensor") || !set["sensor"].is_object()) return nullptr;
    const std::optional<std::string> named = Reader(set["sensor"], folder).Text("calibration");
    if (!named || named->empty()) return nullptr;
    path = folder / *named;
  }
  return std::make_shared<Calibration>(ReadCalibration(path));
}

InputOptions WithCalibratedNoise(InputOptions options, const Calibration* calibration) {
  if (!calibration || calibration->sensor.dn_per_e <= 0) return options;
  if (options.gain <= 0) options.gain = calibration->sensor.dn_per_e;
  if (options.read_noise < 0) options.read_noise = calibration->sensor.read_noise_e;
  return options;
}

InputOptions WithCalibratedSensor(InputOptions options, const Calibration* calibration) {
  if (!calibration) return options;
  const Sensor& sensor = calibration->sensor;
  if (options.layout.empty()) options.layout = ToString(sensor.layout);
  if (options.bits == 0) options.bits = sensor.bits;
  if (options.black_level < 0) options.black_level = sensor.black_dn;
  if (options.white_level <= 0) options.white_level = sensor.white_dn;
  return options;
}

CameraBinding BindingOf(const Input& input) {
  const json set = JsonOf(input.folder);
  json settings = set.value("settings", json::object());
  if (!settings.is_object()) settings = json::object();
  if (input.session && !settings.contains("Gain"))  // NaN, where it is not known, becomes null
    settings["Gain"] = input.session->frames[input.views[0].frames[0]].info.gain_db;
  if (settings.contains("Gain") && settings["Gain"].is_number_float() &&
      std::isnan(settings["Gain"].get<double>()))
    settings.erase("Gain");
  json camera = set.value("camera", json::object());
  if (camera.is_object() && camera.value("model", json()) == "pictures") camera.erase("model");  // imported
  return MakeBinding(camera, settings, input.width, input.height, input.sensor.layout, input.sensor.bits);
}

InputOptions WithSensorJson(InputOptions options, const json& sensor, const std::filesystem::path& where) {
  FillFromSensor(Reader(sensor, where), options);
  return options;
}

std::vector<std::string> MisspelledKeys(const std::filesystem::path& folder) {
  // scale: what tools/render_polar.py notes.
  static const std::vector<std::string> kTop = {"input_kind", "gamma",  "aop_sense", "aop_scale", "angles",
                                                "sensor",     "camera", "settings",  "scale"},
                                        kSensor = {"layout", "bits",        "black_dn", "white_dn",
                                                   "max_dn", "full_well_e", "dn_per_e", "read_noise_e",
                                                   "gamma",  "calibration"};
  std::vector<std::string> words;
  const auto look = [&](const json& object, const std::vector<std::string>& known) {
    for (const auto& [key, value] : object.items()) {
      if (std::ranges::find(known, key) != known.end()) continue;
      const std::string meant = NearestName(key, known);
      if (!meant.empty() && !object.contains(meant))
        words.push_back(fmt::format("{}: \"{}\" means nothing here; is \"{}\" meant?",
                                    (folder / "set.json").string(), key, meant));
    }
  };
  if (!std::filesystem::exists(folder / "set.json")) return words;
  const json set = ReadJson(folder / "set.json");
  look(set, kTop);
  if (set.is_object() && set.contains("sensor") && set["sensor"].is_object()) look(set["sensor"], kSensor);
  return words;
}

InputOptions WithSetJson(InputOptions options, const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / "set.json";
  if (std::filesystem::exists(path)) {
    const json set = ReadJson(path);
    if (!set.is_object()) throw Error("set.json must hold one object", path.string());
    FillFromSet(Reader(set, path), options);
    if (set.contains("sensor")) FillFromSensor(Reader(set["sensor"], path), options);
  }
  if (IsSession(folder)) {
    const json sensor = SensorOf(OpenSession(folder));
    FillFromSensor(Reader(sensor, folder / "session.json"), options);
  }
  Validate(Table(options));
  return options;
}

}  // namespace polarscan
