// SPDX-License-Identifier: Apache-2.0
#include "core/options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "core/error.h"
#include "core/files/files.h"
#include "core/words.h"

namespace polarscan {
namespace {

void CheckRange(const Option& option, double value, bool whole) {
  if (value >= option.min && value <= option.max) return;
  throw Error("option out of range", fmt::format("--{} {}", option.name, NumberText(value, whole)),
              fmt::format("It must be {}{}{}", RangeText(option.min, option.max, whole),
                          option.unit.empty() ? "" : " ", option.unit));
}

void ValidateOption(const Option& option) {
  if (auto number = std::get_if<int*>(&option.value)) CheckRange(option, **number, true);
  if (auto number = std::get_if<double*>(&option.value)) CheckRange(option, **number, false);
  if (auto text = std::get_if<std::string*>(&option.value)) {
    if (!option.choices.empty() && std::ranges::find(option.choices, **text) == option.choices.end())
      throw Error("no such choice", fmt::format("--{} {}", option.name, **text),
                  fmt::format("Choose one of: {}", fmt::join(option.choices, ", ")));
  }
}

template <class T>
void Take(const nlohmann::json& value, T& target) {
  value.get_to(target);
}
void Take(const nlohmann::json& value, int& target) { target = WholeNumber{value}; }

}  // namespace

nlohmann::json ToJson(const OptionTable& table) {
  nlohmann::json values = nlohmann::json::object();
  for (const Option& option : table)
    std::visit([&](auto* value) { values[option.name] = *value; }, option.value);
  return values;
}

void FromJson(const nlohmann::json& values, OptionTable& table) {
  for (const auto& [name, value] : values.items()) {
    const auto option = std::ranges::find_if(table, [&](const Option& row) {
      return row.name == name || (!name.empty() && row.old_name == name);
    });
    if (option == table.end()) {
      std::vector<std::string> names;
      for (const Option& row : table) names.push_back(row.name);
      const std::string nearest = NearestName(name, names);
      throw Error("there is no such option", name, nearest.empty() ? "" : "Did you mean " + nearest + "?");
    }
    try {
      std::visit([&json = value](auto* target) { Take(json, *target); }, option->value);
    } catch (const nlohmann::json::exception&) {
      throw Error("an option has a value of the wrong kind", fmt::format("{} = {}", name, ToText(value)));
    }
    ValidateOption(*option);
  }
}

void Validate(const OptionTable& table) {
  for (const Option& option : table) ValidateOption(option);
}

}  // namespace polarscan
