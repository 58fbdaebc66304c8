// SPDX-License-Identifier: Apache-2.0
#include "pipeline/checksums.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <ctime>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace fs = std::filesystem;
namespace {

constexpr const char* kChecksumFile = "checksums.json";
constexpr std::int64_t kSecond_ns = 1'000'000'000;
const FileSums kNone;

std::int64_t Nanoseconds(const timespec& time) { return time.tv_sec * kSecond_ns + time.tv_nsec; }

std::int64_t Now_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return Nanoseconds(now);
}

std::map<std::string, FileSums> ReadStages(const fs::path& path) {
  std::map<std::string, FileSums> stages;
  try {
    if (!fs::exists(path)) return stages;
    const nlohmann::json stored = ReadJson(path);
    for (const auto& [stage, files] : stored.items())
      for (const auto& [name, file] : files.items())
        stages[stage][name] = {file.at("bytes"), file.at("hash"), file.at("changed_ns")};
  } catch (const std::exception&) {  // then every file is read again
    return {};
  }
  return stages;
}

}  // namespace

bool IsHidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

std::vector<fs::path> FilesBelow(const fs::path& path) {
  std::vector<fs::path> files;
  if (fs::is_regular_file(path)) files.push_back(path);
  if (fs::is_directory(path)) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path))
      if (entry.is_regular_file() && !IsHidden(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string Digest(const FileSums& sums) {
  std::string listing;
  for (const auto& [name, sum] : sums) listing += fmt::format("{} {} {}\n", name, sum.bytes, sum.hash);
  return ToHex(Hash(listing));
}

std::vector<FileDifference> Differences(const FileSums& recorded, const FileSums& found) {
  std::vector<FileDifference> all;
  for (const auto& [name, sum] : recorded) {
    const auto now = found.find(name);
    if (now == found.end())
      all.push_back({name, "is missing"});
    else if (now->second.bytes != sum.bytes || now->second.hash != sum.hash)
      all.push_back({name, "is damaged or was changed"});
  }
  for (const auto& [name, sum] : found)
    if (!recorded.contains(name)) all.push_back({name, "is new"});
  return all;
}

std::string Difference(const FileSums& recorded, const FileSums& found) {
  const std::vector<FileDifference> all = Differences(recorded, found);
  if (all.empty()) return "";
  const std::string first = all[0].file + " " + all[0].what;
  return all.size() == 1 ? first : fmt::format("{}, and {} files more", first, all.size() - 1);
}

Checksums::Checksums(const fs::path& scan) : scan_(scan), stages_(ReadStages(scan / kChecksumFile)) {}

FileSum Checksums::MeasureFile(const std::string& name, bool everything) const {
  const fs::path path = scan_ / name;
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) ThrowSystemError("cannot read the file", path);
  const auto bytes = std::uintmax_t(info.st_size);
  const std::int64_t changed = Nanoseconds(info.st_ctim);
  if (!everything) {
    for (const auto& [stage, files] : stages_) {
      const auto known = files.find(name);
      if (known != files.end() && known->second.bytes == bytes && known->second.changed_ns == changed)
        return known->second;
    }
  }
  // A change so soon after the last one may have the same time.
  return {bytes, ToHex(HashFile(path)), changed + kSecond_ns < Now_ns() ? changed : 0};
}

FileSums Checksums::Measure(const std::vector<fs::path>& outputs, bool everything) const {
  Progress silent;
  return Measure(outputs, everything, silent);
}

FileSums Checksums::Measure(const std::vector<fs::path>& outputs, bool everything, Progress& progress) const {
  FileSums sums;
  for (const fs::path& output : outputs)
    for (const fs::path& file : FilesBelow(scan_ / output)) {
      const std::string name = file.lexically_relative(scan_).string();
      progress.Check();
      sums[name] = MeasureFile(name, everything);
      progress.Advance();
    }
  return sums;
}

const FileSums& Checksums::Recorded(const std::string& stage) const {
  const auto found = stages_.find(stage);
  return found == stages_.end() ? kNone : found->second;
}

void Checksums::Record(const std::string& stage, const FileSums& sums) {
  stages_[stage] = sums;
  nlohmann::json stored = nlohmann::json::object();
  for (const auto& [name, files] : stages_)
    for (const auto& [file, sum] : files)
      stored[name][file] = {{"bytes", sum.bytes}, {"hash", sum.hash}, {"changed_ns", sum.changed_ns}};
  WriteJson(scan_ / kChecksumFile, stored);
}

}  // namespace polarscan
