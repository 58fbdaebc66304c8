// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace polarscan {

enum class CheckState {
  kGood,
  kWarning,  // works, but slower or less safely than it could
  kBad,      // something that polarscan is for cannot work
  kNotApplicable,
};

// One thing that was looked at on this host. Nothing here needs root or changes the host.
struct HostCheck {
  std::string name;
  CheckState state = CheckState::kGood;
  std::string measured;
  std::string required;  // "" where there is nothing to compare with
  std::string fix;  // one line: a command to type, or what to do where no command helps; "" where it is good
};

// "good", "warning", "bad", "not applicable".
std::string ToString(CheckState state);
nlohmann::json ToJson(const HostCheck& check);

// Where the checks look; other folders in tests.
struct Host {
  std::filesystem::path sys = "/sys", proc = "/proc", dev = "/dev";
  // Where udev reads its rules.
  std::vector<std::filesystem::path> rules = {"/etc/udev/rules.d", "/run/udev/rules.d",
                                              "/usr/local/lib/udev/rules.d", "/usr/lib/udev/rules.d"};
};

// First line of a small file of the kernel's, without the line's end; "" if it cannot be read.
std::string ReadLine(const std::filesystem::path& path);

// The number that the file begins with; `otherwise` if there is none.
long ReadNumber(const std::filesystem::path& path, long otherwise);

// Whether this user may read and write the device. It is not opened (that would wake it up).
bool MayUse(const std::filesystem::path& node);

// The program that runs, with its links followed.
std::filesystem::path RunningProgram(const Host& host);

// For a shell: in single quotes.
std::string Quoted(const std::filesystem::path& path);

}  // namespace polarscan
