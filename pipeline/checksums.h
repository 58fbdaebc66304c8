// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/progress.h"

namespace polarscan {

bool IsHidden(const std::filesystem::path& path);  // its name begins with a dot

// All regular files at or below a path, sorted, without hidden ones; none if it does not exist.
std::vector<std::filesystem::path> FilesBelow(const std::filesystem::path& path);

struct FileSum {
  std::uintmax_t bytes = 0;
  std::string hash;  // core/files/files.h: ToHex(HashFile)
  // The system's time of the last change of anything about it; 0: too recent to trust.
  std::int64_t changed_ns = 0;
};
using FileSums = std::map<std::string, FileSum>;  // by path relative to the scan folder

// One hash for names, sizes and contents.
std::string Digest(const FileSums& sums);

// what: "is missing", "is damaged or was changed", "is new".
struct FileDifference {
  std::string file, what;
};
std::vector<FileDifference> Differences(const FileSums& recorded, const FileSums& found);

// "cloud.ply is missing, and 3 files more"; empty: the same.
std::string Difference(const FileSums& recorded, const FileSums& found);

// SCAN/checksums.json: for each stage the files that it left. Damaged or lost it counts as empty; scan.json
// has the digests.
class Checksums {
 public:
  explicit Checksums(const std::filesystem::path& scan);

  // What is there now, at and below these paths. A file of the recorded size and time of change is not read
  // again: the system sets that time itself whenever it is written, so only a disk that loses bits by itself
  // goes unnoticed; `everything` finds that too. A unit of progress is a file; throws Cancelled.
  FileSums Measure(const std::vector<std::filesystem::path>& outputs, bool everything = false) const;
  FileSums Measure(const std::vector<std::filesystem::path>& outputs, bool everything,
                   Progress& progress) const;
  const FileSums& Recorded(const std::string& stage) const;
  void Record(const std::string& stage, const FileSums& sums);  // on disk when it returns

 private:
  FileSum MeasureFile(const std::string& name, bool everything) const;

  std::filesystem::path scan_;
  std::map<std::string, FileSums> stages_;
};

}  // namespace polarscan
