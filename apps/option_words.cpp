// SPDX-License-Identifier: Apache-2.0
#include "apps/option_words.h"

#include <fmt/ranges.h>

#include <algorithm>

namespace polarscan {
namespace {

// The text between two marks, the last of each; empty if they are not there.
std::string Between(const std::string& text, const std::string& begin, char end) {
  const std::size_t from = text.rfind(begin), to = text.rfind(end);
  if (from == std::string::npos || to == std::string::npos || to < from) return "";
  return text.substr(from + begin.size(), to - from - begin.size());
}

// CLI11's type names are "px:FLOAT in [0 - 10]", "TEXT:{a,b}", "TEXT:DIR".
void AddType(const std::string& type, OptionWords& words) {
  words.value = type.substr(0, type.find(':'));
  if (const std::string choices = Between(type, "{", '}'); !choices.empty())
    words.choices = CLI::detail::split(choices, ',');
  words.range = Between(type, " in [", ']');
  if (const std::size_t dash = words.range.find(" - "); dash != std::string::npos)
    words.range.replace(dash, 3, " ... ");
}

OptionWords Words(const CLI::Option& option) {
  OptionWords words;
  words.positional = option.get_positional();
  words.required = option.get_required();
  words.group = option.get_group();
  words.help = option.get_description();
  words.initial = option.get_default_str();
  for (const std::string& name : option.get_snames()) words.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) words.names.push_back("--" + name);
  if (words.positional) words.names = {option.get_name(true)};
  if (option.get_items_expected_max() > 0) AddType(option.get_type_name(), words);
  return words;
}

}  // namespace

std::vector<OptionWords> WordsOf(const CLI::App& command) {
  std::vector<OptionWords> all;
  for (const CLI::Option* option : command.get_options())
    if (!option->get_group().empty()) all.push_back(Words(*option));
  std::ranges::stable_partition(all, [](const OptionWords& words) { return words.positional; });
  return all;
}

std::string LimitsOf(const OptionWords& option) {
  std::vector<std::string> limits;
  if (option.required && !option.positional) limits.push_back("required");
  if (!option.choices.empty()) limits.push_back(fmt::format("one of {}", fmt::join(option.choices, ", ")));
  if (!option.range.empty()) limits.push_back(option.range);
  if (!option.initial.empty()) limits.push_back("default " + option.initial);
  return fmt::format("{}", fmt::join(limits, "; "));
}

std::vector<const CLI::App*> CommandsOf(const CLI::App& command) {
  return command.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<std::string> PathOf(const CLI::App& command) {
  std::vector<std::string> path;
  for (const CLI::App* app = &command; app; app = app->get_parent()) path.push_back(app->get_name());
  std::ranges::reverse(path);
  return path;
}

}  // namespace polarscan
