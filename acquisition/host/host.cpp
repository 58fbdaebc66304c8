// SPDX-License-Identifier: Apache-2.0
#include "acquisition/host/host.h"

#include <unistd.h>

#include <charconv>
#include <fstream>

namespace polarscan {
namespace fs = std::filesystem;

std::string ToString(CheckState state) {
  switch (state) {
    case CheckState::kGood:
      return "good";
    case CheckState::kWarning:
      return "warning";
    case CheckState::kBad:
      return "bad";
    case CheckState::kNotApplicable:
      break;
  }
  return "not applicable";
}

nlohmann::json ToJson(const HostCheck& check) {
  return {{"name", check.name},
          {"state", ToString(check.state)},
          {"measured", check.measured},
          {"required", check.required},
          {"fix", check.fix}};
}

std::string ReadLine(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

long ReadNumber(const fs::path& path, long otherwise) {
  const std::string line = ReadLine(path);
  long value = otherwise;
  std::from_chars(line.data(), line.data() + line.size(), value);
  return value;
}

bool MayUse(const fs::path& node) { return ::access(node.c_str(), R_OK | W_OK) == 0; }

fs::path RunningProgram(const Host& host) {
  std::error_code unknown;
  return fs::read_symlink(host.proc / "self" / "exe", unknown);
}

std::string Quoted(const fs::path& path) {
  std::string text = "'";
  for (const char c : path.string()) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace polarscan
