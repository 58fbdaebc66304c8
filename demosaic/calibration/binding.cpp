// SPDX-License-Identifier: Apache-2.0
#include "demosaic/calibration/binding.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

using nlohmann::json;

// By GenICam's names (SFNC) and the simulated camera's.
constexpr std::array kFeatures = {"OffsetX",
                                  "OffsetY",
                                  "ReverseX",
                                  "ReverseY",
                                  "Gain",
                                  "GainRaw",
                                  "BlackLevel",
                                  "BlackLevelRaw",
                                  "Gamma",
                                  "GammaEnable",
                                  "LUTEnable",
                                  "AdcBitDepth",
                                  "SensorBitDepth",
                                  "BinningHorizontal",
                                  "BinningVertical",
                                  "DecimationHorizontal",
                                  "DecimationVertical",
                                  "ConversionGain",
                                  "full-well",
                                  "read-noise"};

bool Same(const json& a, const json& b) {
  if (!a.is_number() || !b.is_number()) return a == b;
  const double x = a.get<double>(), y = b.get<double>();
  return std::abs(x - y) <= 1e-6 * std::max({1.0, std::abs(x), std::abs(y)});
}

std::string Text(const json& value) { return value.is_string() ? value.get<std::string>() : ToText(value); }

bool Says(const json& object, const std::string& key) {
  return object.contains(key) && !object[key].is_null() && object[key] != "";
}

void Compare(const json& calibration, const json& pictures, std::vector<std::string>& differences) {
  for (const auto& [key, value] : calibration.items())
    if (Says(calibration, key) && Says(pictures, key) && !Same(value, pictures[key]))
      differences.push_back(fmt::format("{} {} instead of {}", key, Text(pictures[key]), Text(value)));
}

}  // namespace

CameraBinding MakeBinding(const json& camera, const json& features, int width, int height,
                          const Layout& layout, int bits) {
  CameraBinding binding;
  for (const char* key : {"vendor", "model", "serial"})
    if (camera.is_object() && Says(camera, key)) binding.camera[key] = camera[key];
  for (const char* key : kFeatures)
    if (features.is_object() && Says(features, key)) binding.settings[key] = features[key];
  binding.settings.update(
      {{"width", width}, {"height", height}, {"layout", ToString(layout)}, {"bits", bits}});
  return binding;
}

std::string HashOf(const CameraBinding& binding) {
  return ToHex(Hash(ToText(binding.camera) + ToText(binding.settings)));
}

void RequireSame(const CameraBinding& calibration, const CameraBinding& pictures, const std::string& where) {
  std::vector<std::string> camera, settings;
  Compare(calibration.camera, pictures.camera, camera);
  Compare(calibration.settings, pictures.settings, settings);
  if (!camera.empty())
    throw Error(
        fmt::format("the pictures are not by the camera of this calibration: {}", fmt::join(camera, ", ")),
        where, "Every camera needs a calibration of its own");
  if (!settings.empty())
    throw Error(fmt::format("the pictures were taken with other settings than this calibration: {}",
                            fmt::join(settings, ", ")),
                where, "Calibrate again with the pictures' settings");
}

}  // namespace polarscan
