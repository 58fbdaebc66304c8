// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <istream>
#include <map>
#include <string>
#include <vector>

namespace polarscan {

// --config: TOML of numbers, texts, true and false, and lists of them, on the program's options or, below
// [COMMAND] or [COMMAND.COMMAND], on a command's. What is not TOML, or names no option, is a CLI::ConfigError
// that says the file, the line, and the nearest name that there is.
class ConfigFile : public CLI::Config {
 public:
  explicit ConfigFile(const CLI::App& program) : program_(program) {}
  std::vector<CLI::ConfigItem> from_config(std::istream& file) const override;
  std::string to_config(const CLI::App*, bool, bool, std::string) const override { return ""; }

  // "settings.toml, line 4" for "--layout", if the file that was read sets it; empty if not.
  std::string PlaceOf(const std::string& option) const;

 private:
  const CLI::App& program_;
  mutable std::map<std::string, std::string> places_;
};

}  // namespace polarscan
