// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string_view>

namespace polarscan {

// A file that only grows. What was appended is safe from a crash of the program, what was synced also from a
// power cut. An interface, so that tests can put slow, failing and forgetful disks in its place.
class AppendFile {
 public:
  virtual ~AppendFile() = default;
  // Both parts or an Error that names the file and the reason; then the end of the file is in an unknown
  // state.
  virtual void Append(std::string_view head, std::string_view body) = 0;
  virtual void Sync() = 0;
  // Cuts the file back to `bytes`: what a failed Append left goes away.
  virtual void Truncate(std::uint64_t bytes) = 0;
};

using AppendFileMaker = std::function<std::unique_ptr<AppendFile>(const std::filesystem::path&)>;

// Makes a new file; its name is synced into the folder. Throws Error if there is one already.
std::unique_ptr<AppendFile> CreateAppendFile(const std::filesystem::path& path);

}  // namespace polarscan
