// SPDX-License-Identifier: Apache-2.0
#include "core/files/temporaries.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <vector>

namespace polarscan {

namespace fs = std::filesystem;

fs::path TemporaryName(const fs::path& path) {
  static std::atomic<unsigned> counter{0};
  return path.parent_path() / fmt::format(".{}.{}-{}.tmp{}", path.stem().string(), ::getpid(), counter++,
                                          path.extension().string());
}

bool IsTemporaryName(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.starts_with('.') && (name.ends_with(".tmp") || name.find(".tmp.") != std::string::npos);
}

void RemoveTemporaries(const fs::path& folder, Below below) {
  if (!fs::is_directory(folder)) return;
  std::vector<fs::path> found;
  fs::recursive_directory_iterator entry(folder);
  for (; entry != fs::end(entry); ++entry) {
    if (below == Below::kNo) entry.disable_recursion_pending();
    if (entry->is_regular_file() && IsTemporaryName(entry->path())) found.push_back(entry->path());
  }
  for (const fs::path& path : found) fs::remove(path);
}

}  // namespace polarscan
