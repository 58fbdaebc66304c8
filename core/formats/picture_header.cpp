// SPDX-License-Identifier: Apache-2.0
#include "core/formats/picture_header.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "core/error.h"
#include "core/formats/tiff_pages.h"

namespace polarscan {
namespace {

constexpr std::size_t kBeginning = 1 << 18;  // holds the tags and the thumbnail of a JPEG

std::uint32_t BigEndian(const std::string& bytes, std::size_t at, int count) {
  std::uint32_t value = 0;
  for (int i = 0; i < count; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + std::size_t(i)]);
  return value;
}

template <class T>
T LittleEndian(const std::string& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

// A side as a file has it; 0 if no picture is that large.
int Side(std::uint64_t pixels) { return pixels <= 1u << 30 ? int(pixels) : 0; }

PictureHeader PngHeader(const std::string& bytes) {
  constexpr std::size_t kSize = 16, kDepth = 24, kColour = 25;
  if (bytes.size() <= kColour) return {};
  constexpr int kChannels[] = {1, 0, 3, 3, 2, 0, 4};  // by colour type; a palette becomes colours
  const auto colour = std::size_t(BigEndian(bytes, kColour, 1));
  return {Side(BigEndian(bytes, kSize, 4)), Side(BigEndian(bytes, kSize + 4, 4)),
          colour < std::size(kChannels) ? kChannels[colour] : 0, BigEndian(bytes, kDepth, 1) == 16 ? 16 : 8};
}

PictureHeader JpegHeader(const std::string& bytes) {
  constexpr std::size_t kSize = 5;  // place of the height and width, from the marker on
  PictureHeader largest;
  for (std::size_t at = 2; at + kSize + 5 <= bytes.size();) {
    const std::uint32_t mark = BigEndian(bytes, at, 2);
    if (mark < 0xFF01 || mark == 0xFFFF) {  // decoders skip what is no marker
      ++at;
      continue;
    }
    if (mark == 0xFFDA) break;  // the picture's data: no header follows
    const bool begins_frame =
        mark >= 0xFFC0 && mark <= 0xFFCF && mark != 0xFFC4 && mark != 0xFFC8 && mark != 0xFFCC;
    const PictureHeader frame{int(BigEndian(bytes, at + kSize + 2, 2)), int(BigEndian(bytes, at + kSize, 2)),
                              int(BigEndian(bytes, at + kSize + 4, 1)), 8};
    if (begins_frame && frame.Pixels() > largest.Pixels()) largest = frame;
    const bool alone = mark == 0xFF01 || (mark >= 0xFFD0 && mark <= 0xFFD9);
    at += alone ? 2 : 2 + BigEndian(bytes, at + 2, 2);
  }
  return largest;
}

PictureHeader BmpHeader(const std::string& bytes) {
  constexpr std::size_t kData = 10, kWidth = 18, kHeight = 22, kDepth = 28, kCompression = 30;
  if (bytes.size() < kCompression + 4) return {};
  const auto width = LittleEndian<std::int32_t>(bytes, kWidth);
  const auto height = std::int64_t(LittleEndian<std::int32_t>(bytes, kHeight));  // below 0: top row first
  const auto depth = LittleEndian<std::uint16_t>(bytes, kDepth);
  if (width < 1 || height == 0) return {};
  PictureHeader header{Side(std::uint64_t(width)), Side(std::uint64_t(std::abs(height))),
                       depth == 32 ? 4
                       : depth > 8 ? 3
                                   : 0,
                       8};  // with a palette: grey or colours
  if (LittleEndian<std::uint32_t>(bytes, kCompression) == 0)
    header.least_bytes = LittleEndian<std::uint32_t>(bytes, kData) +
                         (std::uint64_t(width) * depth + 31) / 32 * 4 * std::uint64_t(std::abs(height));
  return header;
}

// PGM, PPM: "P5", width, height, largest value, with comments from # to the end of a line.
PictureHeader PnmHeader(const std::string& bytes) {
  std::uint64_t numbers[3] = {};
  std::size_t at = 2;
  for (std::uint64_t& number : numbers) {
    while (at < bytes.size() && (std::isspace(static_cast<unsigned char>(bytes[at])) || bytes[at] == '#'))
      at = bytes[at] == '#' ? std::min(bytes.size(), bytes.find('\n', at)) : at + 1;
    const auto [end, error] = std::from_chars(bytes.data() + at, bytes.data() + bytes.size(), number);
    if (error != std::errc()) return {};
    at = std::size_t(end - bytes.data());
  }
  const bool grey = bytes[1] == '2' || bytes[1] == '5', text = bytes[1] < '4';
  PictureHeader header{Side(numbers[0]), Side(numbers[1]), grey ? 1 : 3, numbers[2] > 255 ? 16 : 8};
  header.least_bytes = header.Pixels() * std::uint64_t(header.channels);
  header.least_bytes =
      text ? 2 * header.least_bytes - 1 : header.least_bytes * std::uint64_t(header.bits / 8);
  header.least_bytes += at + 1;
  return header;
}

// Radiance: lines of text, then "-Y height +X width".
PictureHeader RadianceHeader(const std::string& bytes) {
  const std::size_t at = bytes.find("\n-Y ");
  if (at == std::string::npos) return {};
  const char* text = bytes.c_str() + at + 4;
  char* end = nullptr;
  const auto height = std::strtoull(text, &end, 10);
  if (std::strncmp(end, " +X ", 4) != 0) return {};
  return {Side(std::strtoull(end + 4, nullptr, 10)), Side(height), 3, 32};
}

PictureHeader TiffHeader(const std::filesystem::path& path) {
  try {
    const TiffPage page = TiffPages(path).at(0);
    return {page.width, page.height, page.samples, page.bits <= 8 ? 8 : page.bits <= 16 ? 16 : 32};
  } catch (const std::exception&) {
    return {};
  }
}

}  // namespace

PictureHeader HeaderOf(const std::filesystem::path& path, const std::string& bytes) {
  if (bytes.starts_with("\x89PNG")) return PngHeader(bytes);
  if (bytes.starts_with("\xFF\xD8")) return JpegHeader(bytes);
  if (bytes.starts_with("BM")) return BmpHeader(bytes);
  if (bytes.size() > 2 && bytes[0] == 'P' && std::string("2356").find(bytes[1]) != std::string::npos)
    return PnmHeader(bytes);
  if (bytes.starts_with("#?")) return RadianceHeader(bytes);
  if (bytes.starts_with("II") || bytes.starts_with("MM")) return TiffHeader(path);
  return {};
}

PictureHeader ReadPictureHeader(const std::filesystem::path& path) {
  std::string bytes(kBeginning, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(bytes.data(), std::streamsize(bytes.size()));
  bytes.resize(std::size_t(file.gcount()));
  return HeaderOf(path, bytes);
}

}  // namespace polarscan
