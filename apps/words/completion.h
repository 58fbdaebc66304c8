// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace polarscan {

// Scripts that complete commands, options and the values of options that have a list of them, from the same
// tables as --help; everything else completes as a file.
std::string BashCompletion(const CLI::App& program);
std::string ZshCompletion(const CLI::App& program);

}  // namespace polarscan
