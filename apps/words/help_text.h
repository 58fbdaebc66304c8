// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace polarscan {

// How --help looks. It shows the arguments, the group "Options" and the example; --help-all every group, and
// that of the program itself every command.
// Lines are broken at kHelpWidth.
class HelpText : public CLI::Formatter {
 public:
  HelpText();
  std::string make_help(const CLI::App* command, std::string name, CLI::AppFormatMode mode) const override;
  std::string make_option(const CLI::Option* option, bool positional) const override;
  std::string make_subcommand(const CLI::App* command) const override;

 private:
  std::string HelpBelow(const CLI::App& command) const;
  std::string Groups(const CLI::App& command, bool all) const;
};

}  // namespace polarscan
