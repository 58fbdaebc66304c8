// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace polarscan {

// What a command's option is in words: for man pages, completion and the list of options in docs/.
struct OptionWords {
  std::vector<std::string> names;  // with dashes, short ones first; of a positional its name alone
  std::string value;               // "FLOAT", "px"; empty: takes none
  std::vector<std::string> choices;
  std::string range;    // "0 to 10"; empty: any
  std::string initial;  // the default; empty: none
  std::string help;
  std::string group;
  bool positional = false, required = false;
};

OptionWords WordsOf(const CLI::Option& option);

// The options of a command in the order of its --help-all: arguments, then group by group.
std::vector<OptionWords> WordsOf(const CLI::App& command);

// "one of a, b; default a", "0 to 10; default 5", or nothing.
std::string LimitsOf(const OptionWords& option);

// The commands right below a command, or below the program.
std::vector<const CLI::App*> CommandsOf(const CLI::App& command);

// From the program to the command: {"polarscan", "calibrate", "dark"}.
std::vector<std::string> PathOf(const CLI::App& command);

}  // namespace polarscan
