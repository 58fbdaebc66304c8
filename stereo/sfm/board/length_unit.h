// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace polarscan {

// What a scan's lengths are counted in, and how that is known: scan.json's unit, unit_source, unit_sigma.
struct LengthUnit {
  std::string unit = "arbitrary";  // or "mm"
  std::string source = "";         // "board"
  double sigma = 0;                // of the unit, relative, 1 sigma; errors of the print are not in it

  bool IsKnown() const { return unit != "arbitrary"; }
};

// null where it is arbitrary.
nlohmann::json ToJson(const LengthUnit& unit);
// Arbitrary where it is none, or null.
LengthUnit ReadLengthUnit(const nlohmann::json& value);

// What the poses that EstimatePoses left in this folder are counted in.
LengthUnit UnitOfPoses(const std::filesystem::path& sfm_folder);

// "mm (by a board, to 0.02 %)", "arbitrary units".
std::string UnitWords(const LengthUnit& unit);

// 0.000213 as "0.021 %".
std::string PercentText(double share);

}  // namespace polarscan
