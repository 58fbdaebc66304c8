// SPDX-License-Identifier: Apache-2.0
#include "apps/command.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <iostream>

#include "core/files/files.h"
#include "core/words.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

template <class T>
CLI::Validator NumberBetween(double min, double max) {
  constexpr bool kWhole = std::is_same_v<T, int>;
  const std::string range = RangeText(min, max, kWhole);
  const auto check = [=](std::string& text) -> std::string {
    std::conditional_t<kWhole, std::int64_t, double> value = 0;
    if (!CLI::detail::lexical_cast(text, value))
      return fmt::format("it takes {}, not '{}'", kWhole ? "a whole number" : "a number", text);
    if (double(value) >= min && double(value) <= max) return "";
    return fmt::format("{} is out of range: it must be {}", text, range.empty() ? "a finite number" : range);
  };
  return {check, range.empty() ? "" : fmt::format("{} in [{}]", kWhole ? "INT" : "FLOAT", range), ""};
}

CLI::Validator IsOneOf(const std::vector<std::string>& choices) {
  const auto check = [choices](std::string& text) -> std::string {
    if (std::ranges::find(choices, text) != choices.end()) return "";
    const std::string nearest = NearestName(text, choices);
    return fmt::format("there is no '{}'; {}choose one of {}", text,
                       nearest.empty() ? "" : fmt::format("did you mean {}? Else ", nearest),
                       fmt::join(choices, ", "));
  };
  return {check, fmt::format("{{{}}}", fmt::join(choices, ",")), ""};
}

// Why there is nothing at a path that was given.
std::string NotThere(const std::string& path) {
  if (path.empty()) return "its path is empty";
  fs::path above = fs::absolute(path).lexically_normal();
  std::error_code ignored;
  while (above.has_relative_path() && !fs::exists(above, ignored)) above = above.parent_path();
  return fmt::format("there is no {}: what exists of that path is {}", path, above.string());
}

template <class T>
CLI::Option* AddNumber(CLI::App& command, const Option& row, T* value) {
  CLI::Option* option = command.add_option("--" + row.name, *value, row.help)->capture_default_str();
  if (!row.unit.empty()) option->type_name(row.unit);
  return option->check(NumberBetween<T>(row.min, row.max));
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
    if (!row.choices.empty()) option->check(IsOneOf(row.choices));
  }
};

// Its old name, which no help shows.
void AddHidden(CLI::App& command, Option row) {
  row.name = row.old_name;
  std::visit(AddRow{command, row}, row.value);
  command.get_option("--" + row.name)->group("");
}

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
      if (!row.old_name.empty()) AddHidden(command, row);
    }
  }
}

void ShowFirst(CLI::App& command, const std::vector<std::string>& names) {
  for (const std::string& name : names) command.get_option("--" + name)->group("Options");
}

void AddExample(CLI::App& command, const std::string& lines) { command.footer("Example:\n" + lines); }

CLI::Validator IsFolder() {
  const auto check = [](std::string& path) -> std::string {
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) return "";
    if (!fs::exists(path, ignored)) return NotThere(path);
    return fmt::format("{} is a file; a folder is wanted here", path);
  };
  return {check, "", ""};
}

CLI::Validator IsFile() {
  const auto check = [](std::string& path) -> std::string {
    std::error_code ignored;
    if (!fs::exists(path, ignored)) return NotThere(path);
    return fs::is_directory(path, ignored) ? path + " is a folder; a file is wanted here" : "";
  };
  return {check, "", ""};
}

CLI::Validator IsFileOrFolder() {
  const auto check = [](std::string& path) -> std::string {
    std::error_code ignored;
    return fs::exists(path, ignored) ? "" : NotThere(path);
  };
  return {check, "", ""};
}

CLI::Validator IsBetween(int min, int max) { return NumberBetween<int>(min, max); }
CLI::Validator IsBetween(double min, double max) { return NumberBetween<double>(min, max); }

nlohmann::json GivenOptions(const CLI::App& command, const OptionTable& table) {
  nlohmann::json given = nlohmann::json::object();
  const nlohmann::json values = ToJson(table);
  for (const Option& row : table) {
    const CLI::Option* option = command.get_option_no_throw("--" + row.name);
    if (option && option->count() > 0) given[row.name] = values.at(row.name);
  }
  return given;
}

StereoOptions StereoOptionsFrom(const CLI::App& command, StereoOptions parsed, const Context& context) {
  StereoOptions options = StereoPreset(parsed.preset);
  OptionTable table = Table(options);
  FromJson(GivenOptions(command, Table(parsed)), table);
  options.seed = int(context.seed);
  return options;
}

}  // namespace polarscan
