// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <variant>
#include <vector>

namespace polarscan {

// One row of a stage's option table. `value` points into the stage's options struct, which holds the default
// when the table is made. The table feeds the command line, the TOML file, --help, the docs and the effective
// options that are written beside each result: nothing about an option is said anywhere else.
struct Option {
  std::string name;  // as on the command line without dashes: "window-radius"
  std::variant<bool*, int*, double*, std::string*> value;
  std::string help;                       // what it trades, one line
  std::string unit = "";                  // "px", "deg", "rad", "DN", ...
  double min = -1e300, max = 1e300;       // range of numbers
  std::vector<std::string> choices = {};  // allowed strings; empty: any
  std::string old_name = "";              // still understood, never shown
};
using OptionTable = std::vector<Option>;

// {name: value} of every row.
nlohmann::json ToJson(const OptionTable& table);

// The same of the values that options hold.
template <class Options>
nlohmann::json ValuesOf(Options options) {
  return ToJson(Table(options));
}

// Sets rows from {name: value}. Throws Error on an unknown name, a wrong type or a value out of range.
void FromJson(const nlohmann::json& values, OptionTable& table);

// Throws Error naming the first option whose value is out of range or not among its choices.
void Validate(const OptionTable& table);

}  // namespace polarscan
