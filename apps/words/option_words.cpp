// SPDX-License-Identifier: Apache-2.0
#include "apps/words/option_words.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

namespace polarscan {
namespace {

// The text between two marks, the last of each; empty if they are not there.
std::string Between(const std::string& text, const std::string& begin, char end) {
  const std::size_t from = text.rfind(begin), to = text.rfind(end);
  if (from == std::string::npos || to == std::string::npos || to < from) return "";
  return text.substr(from + begin.size(), to - from - begin.size());
}

// CLI11's type names, with the validators of apps/command.h, are "px:FLOAT in [0 to 10]", "TEXT:{a,b}".
void AddType(const std::string& type, OptionWords& words) {
  words.value = type.substr(0, type.find(':'));
  if (words.value == "UINT") words.value = "INT";
  if (const std::string choices = Between(type, "{", '}'); !choices.empty())
    words.choices = CLI::detail::split(choices, ',');
  words.range = Between(type, " in [", ']');
}

// Texts begin with a capital, but where a choice ("paper: ...") or a formula's symbol ("tau_geo ...") begins
// them.
std::string Capitalised(std::string text) {
  const std::string first = text.substr(0, text.find(' '));
  if (first.size() > 1 && first.find_first_of(":_(,/") == std::string::npos)
    text[0] = char(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

}  // namespace

OptionWords WordsOf(const CLI::Option& option) {
  OptionWords words;
  words.positional = option.get_positional();
  words.required = option.get_required();
  words.group = option.get_group();
  words.help = Capitalised(option.get_description());
  words.initial = option.get_default_str();
  for (const std::string& name : option.get_snames()) words.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) words.names.push_back("--" + name);
  if (words.positional) words.names = {option.get_name(true)};
  if (option.get_items_expected_max() > 0) AddType(option.get_type_name(), words);
  return words;
}

std::vector<OptionWords> WordsOf(const CLI::App& command) {
  std::vector<OptionWords> all;
  for (const CLI::Option* option : command.get_options())
    if (!option->get_group().empty()) all.push_back(WordsOf(*option));
  const std::vector<std::string> groups = command.get_groups();
  std::ranges::stable_sort(all, {}, [&](const OptionWords& words) {
    return words.positional ? -1 : std::ranges::find(groups, words.group) - groups.begin();
  });
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
