// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstring>
#include <filesystem>
#include <string>
#include <type_traits>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {

// Reads little-endian values one after another from a whole file; throws Error naming the file when it ends
// too early.
class ByteReader {
 public:
  explicit ByteReader(const std::filesystem::path& path) : path_(path), bytes_(ReadFile(path)) {}

  template <class T>
  T Read() {
    static_assert(std::is_arithmetic_v<T>);
    if (left() < sizeof(T)) Fail("the file ends too early");
    T value;
    std::memcpy(&value, bytes_.data() + position_, sizeof(T));
    position_ += sizeof(T);
    return value;
  }
  // A count of items that take at least `size` bytes each: never more than the file can hold.
  std::size_t ReadCount(std::size_t size) {
    const auto count = Read<std::uint64_t>();
    if (count > left() / size) Fail("the file promises more than it holds");
    return std::size_t(count);
  }
  // Text up to a zero byte.
  std::string ReadText() {
    const std::size_t end = bytes_.find('\0', position_);
    if (end == std::string::npos) Fail("the file ends in the middle of a name");
    std::string text = bytes_.substr(position_, end - position_);
    position_ = end + 1;
    return text;
  }
  void ExpectEnd() const {
    if (left() != 0) Fail("the file holds more than it should");
  }
  [[noreturn]] void Fail(const std::string& what) const {
    throw Error("damaged COLMAP model: " + what, path_.string(),
                "Copy it again from where it came, or make it anew");
  }

 private:
  std::size_t left() const { return bytes_.size() - position_; }
  std::filesystem::path path_;
  std::string bytes_;
  std::size_t position_ = 0;
};

// The way back: values appended to a string.
template <class T>
void AppendValue(std::string& bytes, T value) {
  static_assert(std::is_arithmetic_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

}  // namespace polarscan
