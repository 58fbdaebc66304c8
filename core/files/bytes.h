// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <bit>
#include <cstring>
#include <string>
#include <type_traits>

namespace polarscan {

static_assert(std::endian::native == std::endian::little, "files hold little-endian numbers");

// Appends the number's bytes, little-endian.
template <class T>
requires std::is_arithmetic_v<T>
void AppendBytes(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

}  // namespace polarscan
