// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/colmap/colmap.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "core/error.h"
#include "core/files/files.h"
#include "core/files/process.h"

namespace polarscan {
namespace {

constexpr double kHelpTimeout = 60;  // s
// COLMAP leaves descriptors in the last row of a picture as malloc gave them. So malloc fills what it gives
// (with the complement, as floats -3e-13), and they do not depend on what lay there before.
const std::vector<std::string> kFilledMemory = {
    "GLIBC_TUNABLES=glibc.malloc.perturb=85:glibc.malloc.tcache_count=0"};
const char* const kInstall = "Install it with: sudo apt install colmap";

// Reports how often a word has appeared in a growing file since the start.
class LogCounter {
 public:
  LogCounter(const std::filesystem::path& log, std::string word, std::size_t total, Progress& progress)
      : log_(log), word_(std::move(word)), total_(total), progress_(progress), position_(Size()) {}

  void operator()() {
    if (++calls_ % 10 == 0) Read();
  }

 private:
  std::uintmax_t Size() const {
    std::error_code missing;
    const auto size = std::filesystem::file_size(log_, missing);
    return missing ? 0 : size;
  }
  void Read() {
    if (word_.empty() || Size() <= position_) return;
    std::ifstream file(log_, std::ios::binary);
    file.seekg(std::streamoff(position_));
    for (std::string line; std::getline(file, line) && !file.eof();) {  // whole lines only
      position_ += line.size() + 1;
      if (line.find(word_) != std::string::npos && done_ < total_) {
        progress_.Advance();
        ++done_;
      }
    }
  }

  std::filesystem::path log_;
  std::string word_;
  std::size_t total_, done_ = 0;
  Progress& progress_;
  std::uintmax_t position_;
  int calls_ = 0;
};

std::string FirstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

}  // namespace

std::set<std::string> OptionNames(const std::string& help) {
  const auto is_name = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '_';
  };
  std::set<std::string> names;
  for (std::size_t at = help.find("--"); at != std::string::npos; at = help.find("--", at + 2)) {
    const auto end = std::find_if_not(help.begin() + std::ptrdiff_t(at) + 2, help.end(), is_name);
    names.emplace(help.begin() + std::ptrdiff_t(at) + 2, end);
  }
  names.erase("");
  return names;
}

Colmap::Colmap(const std::string& program, const std::filesystem::path& log, Progress& progress)
    : program_(program), log_(log), progress_(progress) {
  if (FindProgram(program).empty()) throw Error("COLMAP is not installed", program, kInstall);
  const std::string line = FirstLine(Help({"help"}));
  const std::size_t word = line.find("COLMAP ");
  if (word == std::string::npos)
    throw Error(fmt::format("this program does not say that it is COLMAP, but \"{}\"", line), program,
                kInstall);
  version_ = line.substr(word + 7, line.find(' ', word + 7) - word - 7);
}

// What COLMAP prints for `colmap ARGUMENTS`.
std::string Colmap::Help(const std::vector<std::string>& arguments) {
  const auto path = log_.parent_path() / "colmap-help.tmp";
  std::filesystem::remove(path);
  std::vector<std::string> argv = {program_};
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  const ProcessResult result = RunProcess(argv, path, progress_, kHelpTimeout);
  const std::string text = ReadFile(path);
  std::filesystem::remove(path);
  if (result.timed_out)
    throw Error(fmt::format("{} {} does not answer", program_, arguments[0]), program_, kInstall);
  return text;
}

const std::set<std::string>& Colmap::KnownOptions(const std::string& command) {
  const auto [entry, is_new] = known_.try_emplace(command);
  if (is_new) entry->second = OptionNames(Help({command, "-h"}));
  return entry->second;
}

int Colmap::Run(const std::string& command, const std::vector<ColmapOption>& options, const std::string& step,
                std::size_t total, const std::string& counted, const std::filesystem::path& folder) {
  const std::set<std::string>& known = KnownOptions(command);
  std::vector<std::string> argv = {program_, command};
  for (const ColmapOption& option : options) {
    const auto name = std::ranges::find_if(option.names, [&](const auto& n) { return known.contains(n); });
    if (name != option.names.end()) {
      argv.insert(argv.end(), {"--" + *name, option.value});
    } else if (option.required) {
      throw Error(fmt::format("COLMAP {} lists no option {} for {}", version_, option.names.front(), command),
                  program_, "Use a version from 3.8 to 4.x; if it is one, try again");
    }
  }
  std::ofstream(log_, std::ios::app) << fmt::format("\n$ {}\n", fmt::join(argv, " "));
  progress_.Begin(step, total, "picture");
  LogCounter counter(log_, counted, total, progress_);
  const int exit_code = RunProcess(
                            argv, log_, progress_, 0, [&counter] { counter(); }, folder, kFilledMemory)
                            .exit_code;
  if (exit_code != 0) {
    const std::string text = fmt::format("colmap {} ended with exit code {} ({}); see {}", command, exit_code,
                                         Complaint().empty() ? "no complaint" : Complaint(), log_.string());
    // A mapper that finds no model ends so: other attempts follow, and the verdict on the poses.
    command == "mapper" && exit_code == 1 ? progress_.Info(text) : progress_.Warn(text);
  }
  return exit_code;
}

std::string Colmap::Complaint() const {
  std::ifstream file(log_);
  std::string last;
  for (std::string line; std::getline(file, line);) {
    const bool complains =
        line.find("ERROR") != std::string::npos || line.find("rror:") != std::string::npos ||
        line.find("Failed") != std::string::npos || line.find("unrecognised") != std::string::npos ||
        line.find("No good initial") != std::string::npos;
    if (line.starts_with("$ ")) last.clear();  // what an earlier command said does not matter
    if (complains && !line.empty()) last = line;
  }
  return last;
}

}  // namespace polarscan
