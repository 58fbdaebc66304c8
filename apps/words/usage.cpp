// SPDX-License-Identifier: Apache-2.0
#include "apps/words/usage.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>

#include "apps/words/option_words.h"
#include "core/words.h"

namespace polarscan {
namespace {

std::string NameOf(const CLI::App& command) { return fmt::format("{}", fmt::join(PathOf(command), " ")); }

// "calibrate dark ", to begin a sentence with; of the program nothing, since its name stands before every
// message.
std::string Subject(const CLI::App& command) {
  return command.get_parent() ? NameOf(command).substr(NameOf(command).find(' ') + 1) + " " : "";
}

// The command that was asked for, as far as it was understood.
const CLI::App& Asked(const CLI::App& program) {
  const CLI::App* command = &program;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  return *command;
}

// The option that a message of CLI11 is about, the command's or the program's: "--levels: ...", "INPUT is
// required".
const CLI::Option* OptionIn(std::string message, const CLI::App& command) {
  constexpr std::string_view kCount = " arguments to ";  // "Expected exactly 1 arguments to --levels, got 2"
  if (const std::size_t at = message.find(kCount); at != std::string::npos)
    message.erase(0, at + kCount.size());
  for (const CLI::App* app = &command; app; app = app->get_parent())
    for (const CLI::Option* option : app->get_options()) {
      const std::string name = option->get_name();
      if (message.starts_with(name) && message.find_first_of(": ,", name.size()) == name.size())
        return option;
    }
  return nullptr;
}

std::string Example(const CLI::App& command) {
  const std::string footer = command.get_footer();
  const std::size_t begin = footer.find("\n  ");
  if (begin == std::string::npos) return "";
  return ". For example: " + footer.substr(begin + 3, footer.find('\n', begin + 1) - begin - 3);
}

std::string CommandList(const CLI::App& above) {
  std::vector<std::string> names;
  for (const CLI::App* command : CommandsOf(above)) names.push_back(command->get_name());
  return fmt::format("{}", fmt::join(names, ", "));
}

bool LacksOutput(const CLI::App& command) {
  const CLI::Option* output = command.get_option_no_throw("--output");
  return output && output->get_required() && output->count() == 0;
}

// "; perhaps -o WORD is meant", where several arguments were given and the output was not.
std::string OutputMeant(const CLI::App& command) {
  if (!LacksOutput(command)) return "";
  for (const CLI::Option* option : command.get_options())
    if (option->get_positional() && option->count() > 1)
      return fmt::format("; perhaps -o {} is meant", option->results().back());
  return "";
}

std::string OneTooMany(const CLI::App& command, const std::string& word) {
  std::string wanted;
  for (const OptionWords& words : WordsOf(command))
    if (words.positional) wanted += (wanted.empty() ? "" : " ") + words.names[0];
  const std::string meant = LacksOutput(command) ? fmt::format("perhaps -o {} is meant", word)
                                                 : "put quotes around what has spaces";
  return fmt::format("'{}' is one word too many: {}takes {}; {}{}", word, Subject(command),
                     wanted.empty() ? "options only" : wanted, meant, Example(command));
}

std::string Missing(const CLI::App& command, const CLI::Option* option, const std::string& message) {
  if (!option) return message + Example(command);
  const OptionWords words = WordsOf(*option);
  return fmt::format("{}needs {}{}: {}{}{}", Subject(command), option->get_name(),
                     words.positional || words.value.empty() ? "" : " " + words.value, words.help,
                     OutputMeant(command), Example(command));
}

std::string WrongCount(const CLI::Option& option, const std::string& message) {
  if (message.find("At Most") != std::string::npos || message.find("exactly") != std::string::npos)
    return fmt::format("{} is given more than once", option.get_name());
  return fmt::format("{} needs a value behind it: {}", option.get_name(), option.get_description());
}

}  // namespace

std::string NoSuchCommand(const CLI::App& above, const std::string& name) {
  std::vector<std::string> names;
  for (const CLI::App* command : CommandsOf(above)) names.push_back(command->get_name());
  const std::string nearest = NearestName(name, names);
  const std::string what = fmt::format("{}has no command '{}'", Subject(above), name);
  if (nearest.empty()) return fmt::format("{}; there are: {}", what, fmt::join(names, ", "));
  return fmt::format("{}; did you mean {}? {} --help lists all", what, nearest, NameOf(above));
}

std::string NoSuchOption(const CLI::App& command, const std::string& name) {
  const std::string bare = name.substr(std::min(name.find_first_not_of('-'), name.size()));
  std::vector<std::string> names;
  for (const CLI::App* app = &command; app; app = app->get_parent())
    for (const OptionWords& words : WordsOf(*app))
      for (const std::string& full : words.names)
        if (full.starts_with("--")) names.push_back(full.substr(2));
  const std::string nearest = NearestName(bare.substr(0, bare.find('=')), names);
  return fmt::format("{}has no option {}; {}{} --help-all lists all", Subject(command), name,
                     nearest.empty() ? "" : fmt::format("did you mean --{}? ", nearest), NameOf(command));
}

std::string WhatIsWrong(const CLI::App& program, const CLI::ParseError& error, const ConfigFile& config) {
  const std::string message = error.what();
  const CLI::App& command = Asked(program);
  if (dynamic_cast<const CLI::ConfigError*>(&error)) return message;
  if (dynamic_cast<const CLI::FileError*>(&error))
    return "--config: there is no file to read at " + program.get_config_ptr()->as<std::string>();
  for (const std::string& word : program.remaining(true)) {
    if (word.starts_with("-") && word != "-" && word != "--") return NoSuchOption(command, word);
    return CommandsOf(command).empty() ? OneTooMany(command, word) : NoSuchCommand(command, word);
  }
  if (!CommandsOf(command).empty() && dynamic_cast<const CLI::RequiredError*>(&error))
    return fmt::format("{}needs a command: {}. {} --help explains them", Subject(command),
                       CommandList(command), NameOf(command));
  const CLI::Option* option = OptionIn(message, command);
  if (dynamic_cast<const CLI::RequiredError*>(&error)) return Missing(command, option, message);
  if (!option) return fmt::format("{}. {} --help shows what it takes", message, NameOf(command));
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error)) return WrongCount(*option, message);
  const std::string place = config.PlaceOf(option->get_name());
  return fmt::format("{}{}{}{}", message, OutputMeant(command),
                     place.empty() ? "" : fmt::format(" ({} sets it)", place),
                     option->get_positional() ? Example(command) : "");
}

}  // namespace polarscan
