// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/progress.h"

namespace polarscan {

// An option of a COLMAP command. Versions 3.8 to 4.x renamed many ("SiftMatching.use_gpu" became
// "FeatureMatching.use_gpu") and reject the old name: the first name that the installed version's help lists
// is used. None of them listed: the option is left out, or an Error if it is required.
struct ColmapOption {
  std::vector<std::string> names;
  std::string value;
  bool required = false;
};

// The installed COLMAP, run without a shell. Everything that it says goes to `log`, with the command lines.
class Colmap {
 public:
  // `program`: a name in PATH or a path. Throws Error, with the command that installs it, if there is none.
  Colmap(const std::string& program, const std::filesystem::path& log, Progress& progress);

  const std::string& version() const { return version_; }

  // Runs `colmap COMMAND OPTIONS` and counts lines of its log that contain `counted` as progress of `step`.
  // The exit code is returned, but says little (0 for an empty folder, say): judge by what was written.
  // folder: where it works; empty: here.
  int Run(const std::string& command, const std::vector<ColmapOption>& options, const std::string& step,
          std::size_t total, const std::string& counted, const std::filesystem::path& folder = {});

  // Whether the command exists and has the option.
  bool Knows(const std::string& command, const std::string& option) {
    return KnownOptions(command).contains(option);
  }

  // The last complaints in the log, for error messages; "" if there are none.
  std::string Complaint() const;

 private:
  std::string Help(const std::vector<std::string>& arguments);
  const std::set<std::string>& KnownOptions(const std::string& command);

  std::string program_;
  std::filesystem::path log_;
  Progress& progress_;
  std::string version_;
  std::map<std::string, std::set<std::string>> known_;
};

// Names after "--" in a help text.
std::set<std::string> OptionNames(const std::string& help);

}  // namespace polarscan
