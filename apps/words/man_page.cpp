// SPDX-License-Identifier: Apache-2.0
#include "apps/words/man_page.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "apps/words/option_words.h"

namespace polarscan {
namespace {

// Text for troff: dashes that can be copied, nothing taken for a request or an escape.
std::string Plain(const std::string& text) {
  std::string plain = text.starts_with('.') || text.starts_with('\'') ? "\\&" : "";
  for (const char c : text) {
    if (c == '\\')
      plain += "\\e";
    else if (c == '-')
      plain += "\\-";
    else
      plain += c;
  }
  return plain;
}

std::string Bold(const std::string& text) { return "\\fB" + Plain(text) + "\\fR"; }
std::string Italic(const std::string& text) { return "\\fI" + Plain(text) + "\\fR"; }
std::string Join(const std::vector<std::string>& texts, const char* between) {
  return fmt::format("{}", fmt::join(texts, between));
}

std::string Synopsis(const CLI::App& command) {
  std::string line = Bold(Join(PathOf(command), " ")) + " [" + Italic("OPTIONS") + "]";
  if (!CommandsOf(command).empty()) line += " " + Italic("COMMAND");
  for (const OptionWords& option : WordsOf(command))
    if (option.positional) line += " " + Italic(option.names[0]);
  return ".SH SYNOPSIS\n" + line + "\n";
}

std::string Entry(const OptionWords& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.names) names.push_back(option.positional ? Italic(name) : Bold(name));
  std::string entry = ".TP\n" + Join(names, ", ");
  if (!option.value.empty() && !option.positional) entry += " " + Italic(option.value);
  const std::string limits = LimitsOf(option);
  return entry + "\n" + Plain(option.help) + (limits.empty() ? "" : " (" + Plain(limits) + ")") + "\n";
}

std::string Options(const CLI::App& command) {
  std::string text, group;
  for (const OptionWords& option : WordsOf(command)) {
    const std::string title = option.positional ? "ARGUMENTS" : option.group;
    if (title != group) text += ".SH \"" + Plain(title == "Options" ? "OPTIONS" : title) + "\"\n";
    group = title;
    text += Entry(option);
  }
  return text;
}

std::string Commands(const CLI::App& command) {
  std::string text;
  for (const CLI::App* below : CommandsOf(command))
    text += ".TP\n" + Bold(below->get_name()) + "\n" + Plain(below->get_description()) + " (" +
            Bold(ManPageName(*below)) + "(1))\n";
  return text.empty() ? "" : ".SH COMMANDS\n" + text;
}

// The help's "Example:" and what follows it, as it stands.
std::string Examples(const CLI::App& command) {
  std::string text;
  for (const std::string& line : CLI::detail::split(command.get_footer(), '\n'))
    if (!line.ends_with("Example:")) text += Plain(line) + "\n";
  return text.empty() ? "" : ".SH EXAMPLE\n.nf\n" + text + ".fi\n";
}

constexpr const char* kEnd = R"(.SH "EXIT STATUS"
0: done. 1: failed, or stopped by Ctrl\-C. 2: wrong usage. 3: done, but data was lost or damaged.
)";

std::string SeeAlso(const CLI::App& command) {
  if (!command.get_parent()) return "";
  return ".SH \"SEE ALSO\"\n" + Bold(ManPageName(*command.get_parent())) +
         "(1), for the options of all commands too.\n";
}

}  // namespace

std::string ManPageName(const CLI::App& command) { return Join(PathOf(command), "-"); }

std::string ManPage(const CLI::App& command) {
  const std::string name = ManPageName(command);
  return fmt::format(".TH \"{}\" 1 \"\" \"polarscan {}\" \"polarscan\"\n", Plain(name), POLARSCAN_VERSION) +
         ".SH NAME\n" + Plain(name) + " \\- " + Plain(command.get_description()) + "\n" + Synopsis(command) +
         Commands(command) + Options(command) + Examples(command) + kEnd + SeeAlso(command);
}

}  // namespace polarscan
