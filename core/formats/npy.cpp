// SPDX-License-Identifier: Apache-2.0
#include "core/formats/npy.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <string>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

constexpr const char* kNpyAdvice =
    "Save it with numpy.save as float32, height x width or height x width x 3 (red, green, blue); S0, S1 and "
    "S2 each in a file of its own: NAME_s0.npy NAME_s1.npy NAME_s2.npy, or s0/ s1/ s2/";

struct NpyHeader {
  std::string type;  // "<f4"
  std::vector<std::size_t> shape;
  std::size_t begin = 0;  // of the values
  bool by_columns = false;
};

// The text after 'key': in the header's dictionary, up to `end`.
std::string ValueOf(const std::string& text, const std::string& key, char end) {
  const std::size_t at = text.find("'" + key + "':");
  if (at == std::string::npos) return "";
  const std::size_t from = at + key.size() + 3;
  return text.substr(from, text.find(end, from) - from);
}

NpyHeader ReadNpyHeader(const std::string& bytes, const std::filesystem::path& path) {
  const auto byte = [&](std::size_t at) { return std::size_t(static_cast<unsigned char>(bytes[at])); };
  if (!bytes.starts_with("\x93NUMPY") || bytes.size() < 12)
    throw Error("this is not a file of numpy.save", path.string(), kNpyAdvice);
  const bool first = bytes[6] == 1;
  const std::size_t length =
      first ? byte(8) | byte(9) << 8 : byte(8) | byte(9) << 8 | byte(10) << 16 | byte(11) << 24;
  NpyHeader header;
  header.begin = (first ? 10 : 12) + length;
  const std::string text = bytes.substr(first ? 10 : 12, length);
  header.type = ValueOf(text, "descr", ',');
  std::erase_if(header.type, [](char c) { return c == ' ' || c == '\''; });
  header.by_columns = ValueOf(text, "fortran_order", ',').find("False") == std::string::npos;
  const std::string shape = ValueOf(text, "shape", ')');
  for (std::size_t at = shape.find_first_of("0123456789"); at != std::string::npos;
       at = shape.find_first_of("0123456789", at)) {
    std::size_t used = 0;
    if (shape.find_first_not_of("0123456789", at) - at > 6 && shape.size() - at > 6)
      throw Error("this array is too large for a picture", path.string());
    header.shape.push_back(std::stoul(shape.substr(at), &used));
    at += used;
  }
  return header;
}

float Half(std::uint16_t bits) {
  const int exponent = bits >> 10 & 31, mantissa = bits & 1023;
  const float sign = bits >> 15 ? -1.0f : 1.0f;
  if (exponent == 31) return mantissa ? std::nanf("") : sign * INFINITY;
  return sign *
         (exponent ? std::ldexp(float(1024 + mantissa), exponent - 25) : std::ldexp(float(mantissa), -24));
}

template <class T>
float ValueAt(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return float(value);
}

struct NpyType {
  const char* name;
  std::size_t bytes;
  float (*value)(const char*);
};

NpyType TypeOf(const std::string& name, const std::filesystem::path& path) {
  static const NpyType kTypes[] = {
      {"<f4", 4, ValueAt<float>},
      {"<f8", 8, ValueAt<double>},
      {"|u1", 1, ValueAt<std::uint8_t>},
      {"<u2", 2, ValueAt<std::uint16_t>},
      {"<f2", 2, [](const char* bytes) { return Half(std::uint16_t(ValueAt<std::uint16_t>(bytes))); }}};
  for (const NpyType& type : kTypes)
    if (name == type.name) return type;
  throw Error(fmt::format("arrays of type {} are not read", name), path.string(), kNpyAdvice);
}

}  // namespace

NpyArray ReadNpy(const std::filesystem::path& path) {
  const std::string bytes = ReadFile(path);
  const NpyHeader header = ReadNpyHeader(bytes, path);
  const NpyType type = TypeOf(header.type, path);
  const std::vector<std::size_t>& shape = header.shape;
  const std::size_t channels = shape.size() == 3 ? shape[2] : 1;
  if (shape.size() < 2 || shape.size() > 3 || shape[0] < 1 || shape[1] < 1 || channels < 1 || channels > 4)
    throw Error(fmt::format("an array of shape ({}) is no picture", fmt::join(shape, ", ")), path.string(),
                kNpyAdvice);
  const std::size_t pixels = shape[0] * shape[1];
  if (header.begin > bytes.size() || bytes.size() - header.begin < pixels * channels * type.bytes)
    throw Error("the file is cut off before its end", path.string(), "Copy it again from where it came");
  const bool counts = header.type[1] == 'u';
  NpyArray array{{channels, Image<float>(int(shape[1]), int(shape[0]))}, counts ? int(8 * type.bytes) : 32};
  const std::size_t height = shape[0], width = shape[1];
  const auto place = [&](std::size_t y, std::size_t x, std::size_t c) {
    return header.by_columns ? y + height * (x + width * c) : (y * width + x) * channels + c;
  };
  const char* values = bytes.data() + header.begin;
  for (std::size_t c = 0; c < channels; ++c)
    for (std::size_t y = 0; y < height; ++y)
      for (std::size_t x = 0; x < width; ++x)
        array.planes[c](int(x), int(y)) = type.value(values + place(y, x, c) * type.bytes);
  return array;
}

}  // namespace polarscan
