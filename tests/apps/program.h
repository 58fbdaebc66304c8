// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace polarscan::test {

using Words = std::vector<std::string>;

// A new empty folder that disappears with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

// The program's exit codes.
inline constexpr int kDone = 0, kFailed = 1, kWrongUsage = 2, kDataLost = 3;

struct Outcome {
  int exit_code = -1;  // 128 + signal if it died of one
  std::string out, err;
};

// A program that runs while the test goes on; its stdout and stderr go to files.
class Process {
 public:
  // argv[0] is searched in PATH. `environment` goes on top of the test's own.
  explicit Process(const std::vector<std::string>& argv,
                   const std::map<std::string, std::string>& environment = {});
  ~Process();  // kills it if it still runs
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void Signal(int signal);
  bool Running();
  // Waits for the end; kills it (exit code 137) after limit_s.
  Outcome Wait(double limit_s = 300);

 private:
  TemporaryFolder folder_;
  pid_t pid_ = -1;
  int status_ = 0;
  bool ended_ = false;
};

// The built program with these arguments.
std::vector<std::string> Polarscan(std::vector<std::string> arguments);
Outcome RunPolarscan(const std::vector<std::string>& arguments,
                     const std::map<std::string, std::string>& environment = {});

// Whether a shell finds this program.
bool HasProgram(const std::string& name);

// Content of all regular files below a folder by relative path, temporary and lock files (.NAME) left out.
std::map<std::string, std::string> Contents(const std::filesystem::path& folder);

}  // namespace polarscan::test
