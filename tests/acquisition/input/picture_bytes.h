// SPDX-License-Identifier: Apache-2.0
// Pictures made byte by byte: nothing of the program's own writers or of its picture library is in them.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "acquisition/input/masks.h"
#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/image_io.h"

namespace polarscan {

using namespace std::string_literals;

inline constexpr int kWidth = 12, kHeight = 8;

inline bool InObject(int x, int y) { return x >= 3 && x < 9 && y >= 2 && y < 5; }

inline std::string BigEndian(std::uint32_t value, int bytes = 4) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text += char(value >> (8 * i));
  return text;
}

inline std::string Chunk(const std::string& kind, const std::string& data) {
  std::uint32_t crc = ~0u;
  for (const char c : kind + data) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? crc >> 1 ^ 0xEDB88320u : crc >> 1;
  }
  return BigEndian(std::uint32_t(data.size())) + kind + data + BigEndian(~crc);
}

// A PNG of these rows; colour: 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGBA. more: chunks before the
// rows.
inline std::string Png(int bits, int colour, const std::vector<std::string>& rows,
                       const std::string& more = "", int width = kWidth) {
  std::string raw;
  for (const std::string& row : rows) raw += '\0' + row;
  std::uint32_t a = 1, b = 0;
  for (const char c : raw) a = (a + static_cast<unsigned char>(c)) % 65521, b = (b + a) % 65521;
  const auto size = std::uint32_t(raw.size());
  const std::string length = {char(size), char(size >> 8)}, complement = {char(~size), char(~size >> 8)};
  const std::string zlib = "\x78\x01\x01" + length + complement + raw + BigEndian(b << 16 | a);
  return "\x89PNG\r\n\x1A\n"s +
         Chunk("IHDR", BigEndian(std::uint32_t(width)) + BigEndian(std::uint32_t(rows.size())) + char(bits) +
                           char(colour) + "\0\0\0"s) +
         more + Chunk("IDAT", zlib) + Chunk("IEND", "");
}

// The mask of InObject, each pixel's bytes as given.
inline std::vector<std::string> Rows(const std::string& outside, const std::string& object) {
  std::vector<std::string> rows;
  for (int y = 0; y < kHeight; ++y) {
    rows.emplace_back();
    for (int x = 0; x < kWidth; ++x) rows.back() += InObject(x, y) ? object : outside;
  }
  return rows;
}

inline std::vector<std::string> OneBitRows() {
  std::vector<std::string> rows;
  for (int y = 0; y < kHeight; ++y) {
    rows.emplace_back(2, '\0');
    for (int x = 0; x < kWidth; ++x)
      if (InObject(x, y)) rows.back()[std::size_t(x / 8)] |= char(0x80 >> x % 8);
  }
  return rows;
}

inline std::string Exif(int orientation) {
  return "MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"s + char(orientation) + "\0\0\0\0\0\0"s;
}

inline std::string JpegWithExif(const Image<Rgb8>& picture, int orientation) {
  const std::string block = "Exif\0\0"s + Exif(orientation);
  return EncodeJpeg(picture, 95)
      .insert(2, "\xFF\xE1" + BigEndian(std::uint32_t(block.size()) + 2, 2) + block);
}

// A folder of pictures, written byte by byte.
class PictureFolder : public testing::Test {
 protected:
  PictureFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "polarscan-masks-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~PictureFolder() override { std::filesystem::remove_all(folder_); }

  void Write(const std::string& name, const std::string& bytes) const {
    WriteFileAtomically(folder_ / name, bytes);
  }
  void Photo(const std::string& name) const {
    WritePng(folder_ / name, Image<Rgb8>(kWidth, kHeight, {200, 100, 50}));
  }
  Input Open(const InputOptions& options = {}) const { return OpenInput(folder_, options); }
  std::string Warnings(const InputOptions& options = {}) const {
    std::string text;
    for (const std::string& warning : Open(options).warnings) text += warning + "\n";
    return text;
  }
  std::string Odd() const {
    std::string text;
    for (const std::string& odd : CheckMasks(Open(), silent_)) text += odd + "\n";
    return text;
  }
  std::string MaskError() const {
    try {
      Odd();
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  }

  std::filesystem::path folder_;
  Progress silent_;
};

inline void ExpectObject(const Image<std::uint8_t>& mask, const std::string& what) {
  ASSERT_EQ(mask.width(), kWidth) << what;
  ASSERT_EQ(mask.height(), kHeight) << what;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      ASSERT_EQ(mask(x, y), InObject(x, y) ? 255 : 0) << what << " " << x << " " << y;
}

inline bool Tells(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}
#define EXPECT_TELLS(text, part) EXPECT_PRED2(Tells, text, part)

}  // namespace polarscan
