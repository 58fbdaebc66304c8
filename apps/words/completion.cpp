// SPDX-License-Identifier: Apache-2.0
#include "apps/words/completion.h"

#include <fmt/ranges.h>

#include <functional>

#include "apps/words/option_words.h"

namespace polarscan {
namespace {

using Words = std::vector<std::string>;

void ForEachCommand(const CLI::App& command, const std::function<void(const CLI::App&)>& visit) {
  visit(command);
  for (const CLI::App* below : CommandsOf(command)) ForEachCommand(*below, visit);
}

Words NamesOf(const std::vector<const CLI::App*>& commands) {
  Words names;
  for (const CLI::App* command : commands) names.push_back(command->get_name());
  return names;
}

// The command's options and the program's own, which every command takes.
std::vector<OptionWords> Accepted(const CLI::App& command) {
  std::vector<OptionWords> options = WordsOf(command);
  const CLI::App* program = &command;
  while (program->get_parent()) program = program->get_parent();
  if (program == &command) return options;
  for (OptionWords& option : WordsOf(*program))
    if (!option.names.back().starts_with("--help") && option.names.back() != "--version")
      options.push_back(option);
  return options;
}

// One case of the table: a command's path and its words.
std::string BashCommand(const CLI::App& command) {
  Words options;
  std::string values;
  for (const OptionWords& option : Accepted(command)) {
    if (option.positional) continue;
    options.insert(options.end(), option.names.begin(), option.names.end());
    if (option.value.empty()) continue;
    const std::string words =
        option.choices.empty() ? "file=yes" : fmt::format("words=\"{}\"", fmt::join(option.choices, " "));
    values += fmt::format("        {}) {} ;;\n", fmt::join(option.names, "|"), words);
  }
  return fmt::format(
      "    \"{}\")\n      commands=\"{}\"\n      options=\"{}\"\n      case \"$before\" in\n{}      esac "
      ";;\n",
      fmt::join(PathOf(command), " "), fmt::join(NamesOf(CommandsOf(command)), " "), fmt::join(options, " "),
      values);
}

// In single quotes, for a specification of zsh's _arguments.
std::string ZshText(const std::string& text) {
  std::string quoted;
  for (const char c : text) {
    if (c == '\'')
      quoted += "'\\''";
    else if (c == '[' || c == ']' || c == ':' || c == '\\')
      quoted += std::string("\\") + c;
    else
      quoted += c;
  }
  return quoted;
}

std::string ZshOption(const OptionWords& option) {
  std::string value;
  if (!option.value.empty())
    value = ":" + ZshText(option.value) + ":" +
            (option.choices.empty() ? "_files" : fmt::format("({})", fmt::join(option.choices, " ")));
  std::string lines;
  for (const std::string& name : option.names)
    lines += fmt::format("        '{}[{}]{}'\n", name, ZshText(option.help), value);
  return lines;
}

std::string ZshCommand(const CLI::App& command) {
  std::string options, commands;
  for (const OptionWords& option : Accepted(command))
    if (!option.positional) options += ZshOption(option);
  for (const CLI::App* below : CommandsOf(command))
    commands += fmt::format(" '{}:{}'", below->get_name(), ZshText(below->get_description()));
  return fmt::format("    '{}')\n      commands=({} )\n      options=(\n{}      ) ;;\n",
                     fmt::join(PathOf(command), " "), commands, options);
}

std::string Cases(const CLI::App& program, std::string (*one)(const CLI::App&)) {
  std::string cases;
  ForEachCommand(program, [&](const CLI::App& command) { cases += one(command); });
  return cases;
}

constexpr const char* kBash = R"(# bash completion of polarscan; made by polarscan help --write
_polarscan_words() {
  case "$1" in
@CASES@  esac
}

_polarscan() {
  local now="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD-1]}"
  if [[ "$now" == "=" ]]; then now=""; fi
  if [[ "$before" == "=" ]]; then before="${COMP_WORDS[COMP_CWORD-2]}"; fi
  local commands="" options="" words="" file="" path=polarscan word
  _polarscan_words "$path"
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    if [[ " $commands " == *" $word "* ]]; then
      path="$path $word" words="" file=""
      _polarscan_words "$path"
    fi
  done
  if [[ -z "$words$file" ]]; then
    if [[ "$now" == -* ]]; then words="$options"; else words="$commands"; fi
  fi
  COMPREPLY=($(compgen -W "$words" -- "$now"))
}
complete -o default -F _polarscan polarscan
)";

constexpr const char* kZsh = R"(#compdef polarscan
# zsh completion of polarscan; made by polarscan help --write
_polarscan_words() {
  case "$1" in
@CASES@  esac
}

_polarscan() {
  local -a commands options
  local path_words=polarscan word
  integer place=1 at=1
  _polarscan_words "$path_words"
  for word in "${(@)words[2,CURRENT-1]}"; do
    (( ++at ))
    if (( ${commands[(I)$word:*]} )); then
      path_words="$path_words $word" place=at
      _polarscan_words "$path_words"
    fi
  done
  words=("${(@)words[place,-1]}")
  (( CURRENT -= place - 1 ))
  if (( $#commands && CURRENT == 2 )) && [[ "$PREFIX" != -* ]]; then
    _describe command commands
  else
    _arguments "${(@)options}" '*:file:_files'
  fi
}
_polarscan "$@"
)";

std::string Filled(std::string script, const std::string& cases) {
  const std::string place = "@CASES@";
  return script.replace(script.find(place), place.size(), cases);
}

}  // namespace

std::string BashCompletion(const CLI::App& program) { return Filled(kBash, Cases(program, BashCommand)); }

std::string ZshCompletion(const CLI::App& program) { return Filled(kZsh, Cases(program, ZshCommand)); }

}  // namespace polarscan
