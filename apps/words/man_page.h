// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace polarscan {

// "polarscan-calibrate-dark": the name of a command's page in section 1.
std::string ManPageName(const CLI::App& command);

// The manual page (man(7)) of the program or of one of its commands, from the same tables as --help.
std::string ManPage(const CLI::App& command);

}  // namespace polarscan
