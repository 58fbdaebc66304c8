// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "apps/terminal/config_file.h"

namespace polarscan {

// What a wrong command line is answered with, in a sentence or two: what is wrong, and what would be right.
// `program` is as the failed parse left it.
std::string WhatIsWrong(const CLI::App& program, const CLI::ParseError& error, const ConfigFile& config);

// "has no command 'reconstrukt'; did you mean reconstruct?", with all there are if none is near.
std::string NoSuchCommand(const CLI::App& above, const std::string& name);

// "mesh has no option --mesh-dept; did you mean --mesh-depth?" name: with its dashes.
std::string NoSuchOption(const CLI::App& command, const std::string& name);

}  // namespace polarscan
