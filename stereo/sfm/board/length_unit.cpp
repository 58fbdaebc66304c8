// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/board/length_unit.h"

#include <fmt/format.h>

#include "core/files/files.h"

namespace polarscan {

nlohmann::json ToJson(const LengthUnit& unit) {
  if (!unit.IsKnown()) return nullptr;
  return {{"unit", unit.unit}, {"source", unit.source}, {"sigma", unit.sigma}};
}

LengthUnit ReadLengthUnit(const nlohmann::json& value) {
  if (!value.is_object() || value.value("unit", "") != "mm") return {};
  return {"mm", value.value("source", ""), value.value("sigma", 0.0)};
}

LengthUnit UnitOfPoses(const std::filesystem::path& sfm_folder) {
  const std::filesystem::path file = sfm_folder / "model" / "result.json";
  return std::filesystem::exists(file) ? ReadLengthUnit(ReadJson(file).value("unit", nlohmann::json()))
                                       : LengthUnit();
}

std::string UnitWords(const LengthUnit& unit) {
  if (!unit.IsKnown()) return "arbitrary units";
  return fmt::format("{} (by a {}, to {})", unit.unit, unit.source, PercentText(unit.sigma));
}

std::string PercentText(double share) { return fmt::format("{:.2g} %", 100 * share); }

}  // namespace polarscan
