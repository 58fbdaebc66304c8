// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/progress.h"

namespace polarscan {

struct ProcessResult {
  int exit_code = 0;  // 128 + signal if it died of one
  bool timed_out = false;
};

// Full path of a program: itself if it holds a slash, else searched in PATH; empty if there is none.
std::filesystem::path FindProgram(const std::string& name);

// Runs argv[0] with its arguments, without a shell, in a process group of its own; stdout and stderr are
// appended to `log`. When progress is cancelled the whole group is terminated (then killed) and Cancelled is
// thrown; after timeout_s seconds (0: none) it is killed and timed_out is set. Throws Error if the program
// cannot be started. folder: where the program works, for those that leave files there; empty: here.
// environment: "NAME=VALUE" for the program, before what it inherits.
ProcessResult RunProcess(const std::vector<std::string>& argv, const std::filesystem::path& log,
                         Progress& progress, double timeout_s = 0, const std::function<void()>& on_poll = {},
                         const std::filesystem::path& folder = {},
                         const std::vector<std::string>& environment = {});

}  // namespace polarscan
