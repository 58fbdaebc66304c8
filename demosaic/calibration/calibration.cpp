// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/calibration.h"

#include <fmt/format.h>

#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "core/words.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kCalibrationFormat = "polarscan calibration";
constexpr int kCalibrationVersion = 1;

fs::path JsonPath(const fs::path& folder) { return folder / "calibration.json"; }

std::string ChecksumOf(json value) {
  value.erase("checksum");
  return ToHex(Hash(ToText(value)));
}

// Writes the maps under a name of their own; returns what the JSON file says about them.
json WriteMaps(const fs::path& folder, const MosaicCorrection& correction) {
  json names = json::array();
  std::vector<const Image<float>*> pages;
  const auto add = [&](const char* name, const Image<float>& page) {
    if (!page.empty()) names.push_back(name), pages.push_back(&page);
  };
  add("black_dn", correction.black_dn);
  add("a0", correction.responses.a0), add("a1", correction.responses.a1), add("a2", correction.responses.a2);
  if (pages.empty()) return nullptr;
  const fs::path temporary = folder / ".maps.tmp.tif";
  WriteFloatTiff(temporary, pages);
  const std::string hash = ToHex(HashFile(temporary)), name = fmt::format("maps-{}.tif", hash);
  fs::rename(temporary, folder / name);
  SyncFolder(folder);
  return {{"file", name}, {"hash", hash}, {"pages", names}};
}

void RemoveOtherMaps(const fs::path& folder, const json& maps) {
  const std::string keep = maps.is_object() ? maps["file"].get<std::string>() : "";
  std::vector<fs::path> stale;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("maps-") && name.ends_with(".tif") && name != keep) stale.push_back(entry.path());
  }
  for (const fs::path& path : stale) fs::remove(path);
}

Sensor SensorFrom(const json& value) {
  Sensor s;
  s.layout = ParseLayout(value.at("layout"));
  s.bits = WholeNumber{value.at("bits")}, s.black_dn = value.at("black_dn"),
  s.white_dn = value.at("white_dn");
  s.dn_per_e = value.at("dn_per_e"), s.read_noise_e = value.at("read_noise_e");
  return s;
}

MosaicCorrection ReadMaps(const fs::path& folder, const json& maps) {
  MosaicCorrection correction;
  if (!maps.is_object()) return correction;
  const fs::path path = folder / fs::path(maps.at("file").get<std::string>()).filename();
  if (!fs::exists(path)) throw Error("the calibration's maps are missing", path.string(), "Calibrate again");
  if (maps.at("hash") != ToHex(HashFile(path)))
    throw Error("the calibration's maps are damaged (checksum)", path.string(), "Calibrate again");
  std::vector<Image<float>> pages = ReadFloatTiff(path);
  const auto names = maps.at("pages").get<std::vector<std::string>>();
  for (std::size_t i = 0; i < std::min(pages.size(), names.size()); ++i) {
    if (names[i] == "black_dn") correction.black_dn = std::move(pages[i]);
    if (names[i] == "a0") correction.responses.a0 = std::move(pages[i]);
    if (names[i] == "a1") correction.responses.a1 = std::move(pages[i]);
    if (names[i] == "a2") correction.responses.a2 = std::move(pages[i]);
  }
  return correction;
}

Calibration FromJson(const json& value, const fs::path& folder) {
  Calibration calibration;
  calibration.binding = {value.at("camera"), value.at("settings")};
  calibration.sensor = SensorFrom(value.at("sensor"));
  calibration.parts = value.at("parts");
  calibration.hash = value.at("checksum").get<std::string>();
  calibration.correction = ReadMaps(folder, value.at("maps"));
  calibration.folder = folder;
  return calibration;
}

}  // namespace

bool IsCalibration(const fs::path& folder) { return fs::exists(JsonPath(folder)); }

void WriteCalibration(const fs::path& folder, Calibration& calibration) {
  CreateFolder(folder);
  json value = {{"format", kCalibrationFormat},
                {"version", kCalibrationVersion},
                {"camera", calibration.binding.camera},
                {"settings", calibration.binding.settings},
                {"binding", HashOf(calibration.binding)},
                {"sensor", ToJson(calibration.sensor)},
                {"parts", calibration.parts},
                {"maps", WriteMaps(folder, calibration.correction)}};
  value["checksum"] = calibration.hash = ChecksumOf(value);
  WriteJson(JsonPath(folder), value);
  calibration.folder = folder;
  RemoveOtherMaps(folder, value["maps"]);
}

Calibration ReadCalibration(const fs::path& folder) {
  const fs::path path = JsonPath(folder);
  if (!fs::exists(path))
    throw Error("this is no calibration, it has no calibration.json", folder.string(),
                "Give the folder that polarscan calibrate has made");
  const json value = ReadJson(path);
  try {
    if (value.at("format") != kCalibrationFormat)
      throw Error("this is not a calibration of polarscan", path.string());
    if (value.at("version") != kCalibrationVersion)
      throw Error("a newer polarscan has written this calibration", path.string(), "Use that one");
    if (value.at("checksum") != ChecksumOf(value))
      throw Error("the calibration is damaged or was changed by hand (checksum)", path.string(),
                  "Calibrate again");
    return FromJson(value, folder);
  } catch (const json::exception& e) {
    throw Error(fmt::format("calibration.json is damaged ({})", JsonReason(e.what())), path.string());
  }
}

}  // namespace polarscan
