// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "core/files/descriptor.h"

namespace polarscan {

// Whole file as bytes. Throws Error (missing, unreadable, a folder).
std::string ReadFile(const std::filesystem::path& path);

// Writes under a temporary name in the same folder, syncs, renames: a reader sees the old bytes or the new
// ones, never a part. Creates missing parent folders. Throws Error with the path and the system's reason
// (disk full, read-only).
void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes);

// The same for programs and libraries that write by themselves: `write` gets the temporary path (same
// extension).
void WriteAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

// The value as text, on one line or indented. Bytes that are no UTF-8, as a camera or a file's name may hold,
// become U+FFFD; json::dump throws there.
std::string ToText(const nlohmann::json& value, int indent = -1);

// An integer that a file holds: json converts any number, and 1e80 has no int. Throws json::exception if the
// value is none or does not fit.
struct WholeNumber {
  const nlohmann::json& value;
  template <std::integral T>
  operator T() const {
    const auto number = value.get_ref<const nlohmann::json::number_integer_t&>();
    if (!std::in_range<T>(number))
      throw nlohmann::json::out_of_range::create(401, "a number that is too large: " + ToText(value), &value);
    return T(number);
  }
};

nlohmann::json ReadJson(const std::filesystem::path& path);
void WriteJson(const std::filesystem::path& path, const nlohmann::json& value);

// Nothing is overwritten that another made: throws Error, naming the path and the cure, if something is
// there, a file or a folder that holds more than hidden files, and is_ours() does not say that the caller
// made it.
void RequireFree(const std::filesystem::path& path, const std::function<bool()>& is_ours,
                 const std::string& cure = "Choose another name with -o, or move it away");
// Whether the file's first 4 KB hold this text: the mark by which one of ours is told.
bool CarriesMark(const std::filesystem::path& file, const std::string& mark);

void CreateFolder(const std::filesystem::path& path);
// One process at a time works in the folder: who holds the lock (a hidden file .lock) until it is closed, and
// no longer than the process lives, however that ends. what: the folder in messages, as "scan". Throws Error
// if another process holds it, or the folder cannot be written to.
Descriptor LockFolder(const std::filesystem::path& folder, const std::string& what);
// A power cut cannot take the names of new files in it back any more.
void SyncFolder(const std::filesystem::path& path);

// XXH3, 64 bits, of bytes or of a file's bytes. Not cryptographic. ToHex gives 16 digits.
std::uint64_t Hash(std::string_view bytes, std::uint64_t seed = 0);
std::uint64_t HashFile(const std::filesystem::path& path, std::uint64_t seed = 0);
std::string ToHex(std::uint64_t hash);

// "2026-03-09T14:05:00Z"
std::string TimeNow();

// Throws Error for what the system just said in errno (disk full, read-only, ...), with advice.
[[noreturn]] void ThrowSystemError(const std::string& what, const std::filesystem::path& path);

}  // namespace polarscan
