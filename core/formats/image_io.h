// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/image.h"

namespace polarscan {

// A picture as its file holds it: planes grey (1) or red, green, blue (3), values as stored (no gamma, no
// scaling). full_scale is 255, 65535, or 1 for floating-point files; bits is 8, 16 or 32. alpha: empty where
// the file has none or none of it is transparent.
struct Picture {
  std::vector<Image<float>> planes;
  float full_scale = 1;
  int bits = 0;
  Image<float> alpha = {};

  int width() const { return planes.empty() ? 0 : planes[0].width(); }
  int height() const { return planes.empty() ? 0 : planes[0].height(); }
};

// True if the file name ends like a picture that ReadPicture knows (png jpg jpeg tif tiff exr bmp pgm ppm pnm
// hdr npy; any case).
bool IsPictureName(const std::filesystem::path& path);

// Throws Error if the file is missing, of another kind, or damaged (a truncated PNG or JPEG is damaged).
Picture ReadPicture(const std::filesystem::path& path);

// True if all planes are the same.
bool IsGrey(const Picture& picture);

// A mask: 255 where the file is not black, else 0, whatever its depth and colours. Where a part of it is
// transparent, what is not transparent counts instead. Soft masks (more than 16 values, most of the object
// near the brightest one) are cut at half of the brightest value; in JPEG files values up to 16 are black.
Image<std::uint8_t> ReadMask(const std::filesystem::path& path);

// The same from a picture's alpha; empty where it hides nothing or everything.
Image<std::uint8_t> MaskFromAlpha(const Picture& picture);

// PNG writers; atomic (core/files/files.h). Grey, colour, 16-bit grey.
void WritePng(const std::filesystem::path& path, const Image<std::uint8_t>& image);
void WritePng(const std::filesystem::path& path, const Image<Rgb8>& image);
void WritePng(const std::filesystem::path& path, const Image<std::uint16_t>& image);
// 16-bit grey TIFF, lossless; atomic.
void WriteTiff(const std::filesystem::path& path, const Image<std::uint16_t>& image);

// The bytes of a JPEG file (quality 1 to 100), for pictures inside an HTML page.
std::string EncodeJpeg(const Image<Rgb8>& image, int quality);

// A TIFF with one float32 grey page per image (Deflate, lossless), all of one size. Atomic. description: the
// first page's ImageDescription; none if empty.
void WriteFloatTiff(const std::filesystem::path& path, const std::vector<const Image<float>*>& pages,
                    const std::string& description = "");
std::vector<Image<float>> ReadFloatTiff(const std::filesystem::path& path,
                                        std::string* description = nullptr);

}  // namespace polarscan
