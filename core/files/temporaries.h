// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace polarscan {

// The names under which files are written before they are renamed (core/files/files.h): hidden, in the same
// folder, unique among threads and processes; the extension stays last, because picture libraries look at it.
std::filesystem::path TemporaryName(const std::filesystem::path& path);
bool IsTemporaryName(const std::filesystem::path& path);

// Removes what a killed program left in a folder, and in those below it. Nobody else may be writing there.
enum class Below { kNo, kYes };
void RemoveTemporaries(const std::filesystem::path& folder, Below below);

}  // namespace polarscan
