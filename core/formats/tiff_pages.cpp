// SPDX-License-Identifier: Apache-2.0
#include "core/formats/tiff_pages.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <cstring>
#include <fstream>
#include <memory>

#include "core/error.h"

namespace polarscan {
namespace {

constexpr std::size_t kMostPages = 60'000;
constexpr const char* kCopyTiffAgain = "Copy the file again from where it came, or remove it";

struct TiffPagesCloser {
  void operator()(TIFF* file) const { TIFFClose(file); }
};
using OpenedTiff = std::unique_ptr<TIFF, TiffPagesCloser>;

OpenedTiff OpenForPages(const std::filesystem::path& path) {
  TIFFSetWarningHandler(nullptr);
  TIFFSetErrorHandler(nullptr);
  OpenedTiff file(TIFFOpen(path.c_str(), "r"));
  if (!file) throw Error("this is not a TIFF file, or it is damaged", path.string(), kCopyTiffAgain);
  return file;
}

template <class T>
T Tag(TIFF* file, std::uint32_t tag) {
  T value = 0;
  TIFFGetFieldDefaulted(file, tag, &value);
  return value;
}

TiffPage PageOf(TIFF* file, int directory) {
  TiffPage page{directory};
  page.width = int(Tag<std::uint32_t>(file, TIFFTAG_IMAGEWIDTH));
  page.height = int(Tag<std::uint32_t>(file, TIFFTAG_IMAGELENGTH));
  page.samples = Tag<std::uint16_t>(file, TIFFTAG_SAMPLESPERPIXEL);
  page.bits = Tag<std::uint16_t>(file, TIFFTAG_BITSPERSAMPLE);
  page.floating = Tag<std::uint16_t>(file, TIFFTAG_SAMPLEFORMAT) == SAMPLEFORMAT_IEEEFP;
  const auto meaning = Tag<std::uint16_t>(file, TIFFTAG_PHOTOMETRIC);
  page.rgb = page.samples >= 3 && meaning != PHOTOMETRIC_MINISBLACK && meaning != PHOTOMETRIC_MINISWHITE;
  std::uint16_t extra = 0, *kinds = nullptr;
  if (TIFFGetField(file, TIFFTAG_EXTRASAMPLES, &extra, &kinds) == 1 && extra > 0)
    page.has_alpha = kinds[extra - 1] == EXTRASAMPLE_ASSOCALPHA || kinds[extra - 1] == EXTRASAMPLE_UNASSALPHA;
  return page;
}

// Rows (or tiles) as the library decodes them, put into the planes.
struct Part {
  std::uint32_t left, top, width, height;  // as stored; may reach beyond the picture
  int sample;                              // the first one in it
  int samples;                             // in it, a pixel
};

template <class T>
void Scatter(const std::vector<unsigned char>& bytes, const Part& part, std::vector<Image<float>>& planes) {
  for (std::uint32_t y = 0; y < part.height; ++y)
    for (std::uint32_t x = 0; x < part.width; ++x)
      for (int s = 0; s < part.samples; ++s) {
        Image<float>& plane = planes[std::size_t(part.sample + s)];
        const int to_x = int(part.left + x), to_y = int(part.top + y);
        if (to_x >= plane.width() || to_y >= plane.height()) continue;
        const std::size_t at =
            ((std::size_t(y) * part.width + x) * std::size_t(part.samples) + std::size_t(s)) * sizeof(T);
        T value;
        std::memcpy(&value, bytes.data() + at, sizeof value);
        plane(to_x, to_y) = float(value);
      }
}

void Scatter(const TiffPage& page, const std::vector<unsigned char>& bytes, const Part& part,
             std::vector<Image<float>>& planes) {
  if (page.bits == 8) return Scatter<std::uint8_t>(bytes, part, planes);
  if (page.bits == 16) return Scatter<std::uint16_t>(bytes, part, planes);
  Scatter<float>(bytes, part, planes);
}

void ReadParts(TIFF* file, const TiffPage& page, const std::filesystem::path& path,
               std::vector<Image<float>>& planes) {
  const bool tiled = TIFFIsTiled(file) != 0;
  const bool apart = Tag<std::uint16_t>(file, TIFFTAG_PLANARCONFIG) == PLANARCONFIG_SEPARATE;
  const auto width = std::uint32_t(page.width), height = std::uint32_t(page.height);
  const std::uint32_t part_width = tiled ? Tag<std::uint32_t>(file, TIFFTAG_TILEWIDTH) : width,
                      part_height = tiled ? Tag<std::uint32_t>(file, TIFFTAG_TILELENGTH) : 1;
  const int samples = apart ? 1 : page.samples;
  const std::size_t size =
      std::size_t(part_width) * part_height * std::size_t(samples) * std::size_t(page.bits / 8);
  if (part_width == 0 || part_height == 0 ||
      size != std::size_t(tiled ? TIFFTileSize64(file) : TIFFScanlineSize64(file)))
    throw Error("the tags of this TIFF page do not fit together", path.string(), kCopyTiffAgain);
  std::vector<unsigned char> bytes(size);
  for (int sample = 0; sample < page.samples; sample += samples)
    for (std::uint32_t top = 0; top < height; top += part_height)
      for (std::uint32_t left = 0; left < width; left += part_width) {
        const bool good = tiled ? TIFFReadTile(file, bytes.data(), left, top, 0, std::uint16_t(sample)) >= 0
                                : TIFFReadScanline(file, bytes.data(), top, std::uint16_t(sample)) == 1;
        if (!good) throw Error("the TIFF file is damaged or cut off", path.string(), kCopyTiffAgain);
        Scatter(page, bytes, {left, top, part_width, part_height, sample, samples}, planes);
      }
}

}  // namespace

bool IsTiff(const std::filesystem::path& path) {
  char bytes[2] = {};
  std::ifstream(path, std::ios::binary).read(bytes, 2);
  return (bytes[0] == 'I' && bytes[1] == 'I') || (bytes[0] == 'M' && bytes[1] == 'M');
}

std::vector<TiffPage> TiffPages(const std::filesystem::path& path) {
  const OpenedTiff file = OpenForPages(path);
  std::vector<TiffPage> pages;
  for (int directory = 0;; ++directory) {
    if (!(Tag<std::uint32_t>(file.get(), TIFFTAG_SUBFILETYPE) & FILETYPE_REDUCEDIMAGE))
      pages.push_back(PageOf(file.get(), directory));
    if (TIFFLastDirectory(file.get()) || pages.size() >= kMostPages) return pages;
    if (TIFFReadDirectory(file.get()) != 1)
      throw Error("the TIFF file is cut off before its last page", path.string(), kCopyTiffAgain);
  }
}

std::vector<Image<float>> ReadTiffSamples(const std::filesystem::path& path, const TiffPage& page) {
  const OpenedTiff file = OpenForPages(path);
  if (TIFFSetDirectory(file.get(), tdir_t(page.directory)) != 1)
    throw Error("the TIFF file is cut off before its last page", path.string(), kCopyTiffAgain);
  const auto meaning = Tag<std::uint16_t>(file.get(), TIFFTAG_PHOTOMETRIC);
  const bool counts = Tag<std::uint16_t>(file.get(), TIFFTAG_SAMPLEFORMAT) == SAMPLEFORMAT_UINT;
  constexpr int kLargestSide = 1 << 16, kMostSamples = 64;
  if ((meaning != PHOTOMETRIC_MINISBLACK && meaning != PHOTOMETRIC_RGB) ||
      !(page.floating ? page.bits == 32 : counts && (page.bits == 8 || page.bits == 16)))
    throw Error("the samples of this TIFF page are of a kind that is not read", path.string(),
                "Save it as grey or RGB of 8 or 16 bits, or float32");
  const std::uint64_t samples =
      std::uint64_t(page.width) * std::uint64_t(page.height) * std::uint64_t(page.samples);
  constexpr std::uint64_t kMostInflatedTiff = 1100;  // bytes out of one
  if (page.width < 1 || page.height < 1 || page.width > kLargestSide || page.height > kLargestSide ||
      page.samples < 1 || page.samples > kMostSamples ||
      samples > 8 * kMostInflatedTiff * std::filesystem::file_size(path))
    throw Error("the TIFF file promises more pixels than it can hold", path.string(), kCopyTiffAgain);
  std::vector<Image<float>> planes(std::size_t(page.samples), Image<float>(page.width, page.height));
  ReadParts(file.get(), page, path, planes);
  return planes;
}

}  // namespace polarscan
