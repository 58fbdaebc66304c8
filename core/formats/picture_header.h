// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

namespace polarscan {

// What a picture's file says of itself before it is decoded; 0 where it is not known.
struct PictureHeader {
  int width = 0, height = 0;      // px
  int channels = 0;               // with alpha
  int bits = 0;                   // of a sample as Picture has it: 8, 16, 32
  std::uint64_t least_bytes = 0;  // that a file of this header must have

  std::uint64_t Pixels() const { return std::uint64_t(width) * std::uint64_t(height); }
};

// `bytes`: the file's, or only its beginning. Of a JPEG the largest frame that it announces; of a TIFF the
// first page. Never throws: what cannot be read stays 0.
PictureHeader HeaderOf(const std::filesystem::path& path, const std::string& bytes);

// The same, from the beginning of the file.
PictureHeader ReadPictureHeader(const std::filesystem::path& path);

}  // namespace polarscan
