// SPDX-License-Identifier: Apache-2.0
#include "apps/words/help_text.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>

#include "apps/words/option_words.h"

namespace polarscan {
namespace {

constexpr std::size_t kHelpWidth = 110, kNameWidth = 34;

// The name, and the text beside it or, if the name is long, below it.
std::string HelpEntry(const std::string& name, const std::string& text) {
  const std::string indent(kNameWidth, ' ');
  std::string entry, line = "  " + name;
  if (line.size() + 1 > kNameWidth) entry = line + "\n", line.clear();
  line.resize(kNameWidth, ' ');
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (line.size() > kNameWidth && line.size() + 1 + word.size() > kHelpWidth)
      entry += line + "\n", line = indent;
    line += (line.size() > kNameWidth ? " " : "") + word;
  }
  return entry + line + "\n";
}

}  // namespace

HelpText::HelpText() { label("Positionals", "Arguments"); }

std::string HelpText::make_help(const CLI::App* command, std::string name, CLI::AppFormatMode mode) const {
  const std::string path = name.empty() ? fmt::format("{}", fmt::join(PathOf(*command), " ")) : name;
  const bool all = mode == CLI::AppFormatMode::All;
  std::string text = make_description(command) + make_usage(command, path) + make_positionals(command) +
                     Groups(*command, all) + make_subcommands(command, CLI::AppFormatMode::Normal) + "\n" +
                     make_footer(command);
  if (all && !command->get_parent()) text += HelpBelow(*command);
  return text;
}

// Of every command below, and those below them.
std::string HelpText::HelpBelow(const CLI::App& command) const {
  std::string text;
  for (const CLI::App* below : CommandsOf(command))
    text += "\n" + make_help(below, "", CLI::AppFormatMode::All) + HelpBelow(*below);
  return text;
}

std::string HelpText::Groups(const CLI::App& command, bool all) const {
  std::string text;
  bool hidden = false;
  for (const std::string& group : command.get_groups()) {
    if (group.empty()) continue;
    const std::vector<const CLI::Option*> options = command.get_options(
        [&](const CLI::Option* o) { return o->get_group() == group && o->nonpositional(); });
    const bool show = all || group == "Options";
    if (!options.empty() && show) text += make_group(group, false, options);
    if (!options.empty() && !show) hidden = true;
  }
  if (!hidden) return text;
  return text +
         fmt::format("\nThese are the options that people use first; {} --help-all shows all of them.\n",
                     fmt::join(PathOf(command), " "));
}

std::string HelpText::make_option(const CLI::Option* option, bool) const {
  const OptionWords words = WordsOf(*option);
  std::string name = fmt::format("{}", fmt::join(words.names, ","));
  if (!words.positional && !words.value.empty()) name += " " + words.value;
  const std::string limits = LimitsOf(words);
  return HelpEntry(name, limits.empty() ? words.help : fmt::format("{} ({})", words.help, limits));
}

std::string HelpText::make_subcommand(const CLI::App* command) const {
  return HelpEntry(command->get_name(), command->get_description());
}

}  // namespace polarscan
