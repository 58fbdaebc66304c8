// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/error.h"

namespace polarscan {

// A folder in memory for one fuzz target's process.
inline const std::filesystem::path& FuzzFolder() {
  static const std::filesystem::path folder = [] {
    const std::filesystem::path memory = "/dev/shm";
    const auto base = std::filesystem::exists(memory) ? memory : std::filesystem::temp_directory_path();
    auto made = base / ("polarscan-fuzz-" + std::to_string(getpid()));
    std::filesystem::create_directories(made);
    return made;
  }();
  return folder;
}

inline void WriteFuzzFile(const std::filesystem::path& path, const char* data, std::size_t size) {
  std::ofstream(path, std::ios::binary | std::ios::trunc).write(data, std::streamsize(size));
}

// What `polarscan check` does: reads it or throws Error; anything else is found by the sanitizers.
template <class Check>
int CheckFuzzed(Check&& check) {
  try {
    check();
  } catch (const Error&) {
  }
  return 0;
}

}  // namespace polarscan
