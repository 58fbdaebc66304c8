// SPDX-License-Identifier: Apache-2.0
#include "apps/command.h"

#include <iostream>

#include "core/files.h"

namespace polarscan {
namespace {

template <class T>
CLI::Option* AddNumber(CLI::App& command, const Option& row, T* value) {
  CLI::Option* option = command.add_option("--" + row.name, *value, row.help)->capture_default_str();
  if (!row.unit.empty()) option->type_name(row.unit);
  if (row.min > -1e300 || row.max < 1e300) option->check(CLI::Range(row.min, row.max));
  return option;
}

struct AddRow {
  CLI::App& command;
  const Option& row;
  void operator()(bool* value) const {
    command.add_flag("--" + row.name + ",!--no-" + row.name, *value, row.help)
        ->default_str(*value ? "yes" : "no");
  }
  void operator()(int* value) const { AddNumber(command, row, value); }
  void operator()(double* value) const { AddNumber(command, row, value); }
  void operator()(std::string* value) const {
    CLI::Option* option = command.add_option("--" + row.name, *value, row.help)->capture_default_str();
    if (!row.choices.empty()) option->check(CLI::IsMember(row.choices));
  }
};

// The option exists already: what it is given goes to `row` as well.
void Share(CLI::Option& option, const Option& row) {
  std::visit(
      [&option](auto* value) {
        option.each([value](const std::string& text) { CLI::detail::lexical_cast(text, *value); });
      },
      row.value);
}

}  // namespace

void Context::Finish(const nlohmann::json& result, const std::string& text) const {
  progress.End();
  if (json) {
    std::cout << ToText(result, 2) << std::endl;
  } else {
    progress.Say(text);
  }
}

void AddOptions(CLI::App& command, const OptionTable& table, const std::string& group) {
  for (const Option& row : table) {
    if (row.name == "seed") continue;
    if (CLI::Option* present = command.get_option_no_throw("--" + row.name)) {
      Share(*present, row);
    } else {
      std::visit(AddRow{command, row}, row.value);
      command.get_option("--" + row.name)->group(group);
    }
  }
}

nlohmann::json GivenOptions(const CLI::App& command, const OptionTable& table) {
  nlohmann::json given = nlohmann::json::object();
  const nlohmann::json values = ToJson(table);
  for (const Option& row : table) {
    const CLI::Option* option = command.get_option_no_throw("--" + row.name);
    if (option && option->count() > 0) given[row.name] = values.at(row.name);
  }
  return given;
}

}  // namespace polarscan
