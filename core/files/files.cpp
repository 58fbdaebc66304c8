// SPDX-License-Identifier: Apache-2.0
#include "core/files/files.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <system_error>

#include "core/error.h"
#include "core/files/descriptor.h"
#include "core/files/temporaries.h"
#include "core/words.h"

namespace polarscan {
namespace {

void SyncPath(const std::filesystem::path& path, int flags) {
  const Descriptor file(::open(path.c_str(), flags | O_CLOEXEC));
  int result = file.fd < 0 ? -1 : ::fsync(file.fd);
  while (file.fd >= 0 && result != 0 && errno == EINTR) result = ::fsync(file.fd);
  if (result != 0) ThrowSystemError("cannot write to the disk", path);
}

// Nothing but what is hidden, and folders of that kind.
bool HoldsNothing(const std::filesystem::path& folder) {
  return std::ranges::all_of(std::filesystem::directory_iterator(folder), [](const auto& entry) {
    const bool is_folder = entry.is_directory() && !entry.is_symlink();
    return entry.path().filename().string().starts_with('.') || (is_folder && HoldsNothing(entry.path()));
  });
}

}  // namespace

void ThrowSystemError(const std::string& what, const std::filesystem::path& path) {
  const int code = errno;
  std::string reason = std::strerror(code), advice;
  if (code == ENOSPC || code == EDQUOT) reason = "disk full", advice = "Free some space first";
  const bool forbidden = code == EROFS || code == EACCES || code == EPERM;
  if (forbidden)
    advice = what.starts_with("cannot read") ? "Ask for the right to read it"
                                             : "Choose a folder that you may write to";
  throw Error(fmt::format("{} ({})", what, reason), path.string(), advice);
}

std::string ReadFile(const std::filesystem::path& path) {
  const Descriptor file(
      ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));  // of a pipe: without waiting
  struct stat info {};
  if (file.fd < 0 || ::fstat(file.fd, &info) != 0) ThrowSystemError("cannot read the file", path);
  if (S_ISDIR(info.st_mode))
    throw Error("a file was expected, this is a folder", path.string(), "Name a file in it");
  if (!S_ISREG(info.st_mode))
    throw Error("this is a pipe or a device", path.string(), "Copy what it gives to a file first");
  std::string bytes;
  bytes.reserve(std::size_t(info.st_size));
  char buffer[1 << 16];
  while (true) {
    const ssize_t n = ::read(file.fd, buffer, sizeof buffer);
    if (n == 0) return bytes;
    if (n > 0) bytes.append(buffer, std::size_t(n));
    if (n < 0 && errno != EINTR) ThrowSystemError("cannot read the file", path);
  }
}

void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes) {
  WriteAtomically(path, [&](const std::filesystem::path& temporary) {
    const Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
    if (file.fd < 0) ThrowSystemError("cannot write the file", path);
    while (!bytes.empty()) {
      const ssize_t n = ::write(file.fd, bytes.data(), bytes.size());
      if (n < 0 && errno != EINTR) ThrowSystemError("cannot write the file", path);
      if (n > 0) bytes.remove_prefix(std::size_t(n));
    }
  });
}

void WriteAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write) {
  if (path.has_parent_path()) CreateFolder(path.parent_path());
  const std::filesystem::path temporary = TemporaryName(path);
  try {
    write(temporary);
    SyncPath(temporary, O_RDONLY);
    if (::rename(temporary.c_str(), path.c_str()) != 0)
      ThrowSystemError("cannot rename the finished file", path);
  } catch (...) {
    ::unlink(temporary.c_str());
    throw;
  }
  SyncFolder(path.parent_path());
}

void RequireFree(const std::filesystem::path& path, const std::function<bool()>& is_ours,
                 const std::string& cure) {
  namespace fs = std::filesystem;
  if (!fs::exists(fs::symlink_status(path)) || (fs::is_directory(path) && HoldsNothing(path))) return;
  try {
    if (is_ours()) return;
  } catch (const std::exception&) {  // who cannot be read is not ours
  }
  throw Error(fs::is_directory(path) ? "this folder holds files that this command did not make"
                                     : "this file is there already, and this command did not make it",
              path.string(), cure);
}

bool CarriesMark(const std::filesystem::path& file, const std::string& mark) {
  std::ifstream stream(file, std::ios::binary);
  std::string beginning(4096, '\0');
  stream.read(beginning.data(), std::streamsize(beginning.size()));
  beginning.resize(std::size_t(stream.gcount()));
  return beginning.find(mark) != std::string::npos;
}

namespace {

// byte: of the last character that the parser took, counted from 1.
std::string WhereParsingStopped(std::string_view text, std::size_t byte) {
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) return "it is empty";
  if (byte == 0 || byte > text.size()) return "it ends too early: it was cut off, or a bracket is missing";
  const std::string_view before = text.substr(0, byte - 1);
  const std::size_t line = 1 + std::size_t(std::ranges::count(before, '\n')),
                    column = byte - 1 - before.rfind('\n');
  return fmt::format("line {}, column {}: what stands there ({}) does not belong there", line, column,
                     Excerpt(text.substr(byte - 1, text.substr(byte - 1).find('\n'))));
}

}  // namespace

std::string ToText(const nlohmann::json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

nlohmann::json ReadJson(const std::filesystem::path& path) {
  const std::string text = ReadFile(path);
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    throw Error(fmt::format("this is not valid JSON: {}", WhereParsingStopped(text, error.byte)),
                path.string());
  } catch (const nlohmann::json::exception& error) {
    throw Error(fmt::format("this is not valid JSON ({})", JsonReason(error.what())), path.string());
  }
}

void WriteJson(const std::filesystem::path& path, const nlohmann::json& value) {
  WriteFileAtomically(path, ToText(value, 1) + "\n");
}

void SyncFolder(const std::filesystem::path& path) {
  SyncPath(path.empty() ? "." : path, O_RDONLY | O_DIRECTORY);
}

void CreateFolder(const std::filesystem::path& path) {
  std::error_code code;
  std::filesystem::create_directories(path, code);
  if (!code) return;
  errno = code.value();
  ThrowSystemError("cannot create the folder", path);
}

Descriptor LockFolder(const std::filesystem::path& folder, const std::string& what) {
  Descriptor file(::open((folder / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
  if (file.fd < 0)
    throw Error(fmt::format("the {} cannot be written to ({})", what, std::strerror(errno)), folder.string(),
                "Choose a folder that you may write to");
  if (::flock(file.fd, LOCK_EX | LOCK_NB) != 0)
    throw Error(fmt::format("another polarscan is working on this {}", what), folder.string(),
                "Wait for it, or stop it first");
  return file;
}

std::uint64_t Hash(std::string_view bytes, std::uint64_t seed) {
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed);
}

std::uint64_t HashFile(const std::filesystem::path& path, std::uint64_t seed) {
  return Hash(ReadFile(path), seed);
}

std::string TimeNow() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))); }

std::string ToHex(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

}  // namespace polarscan
