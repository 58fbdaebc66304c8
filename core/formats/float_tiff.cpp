// SPDX-License-Identifier: Apache-2.0
// WriteFloatTiff and ReadFloatTiff, by libtiff.
#include <tiffio.h>

#include <algorithm>
#include <cerrno>
#include <memory>

#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/image_io.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostDeflated = 1100;  // bytes out of one byte: the limit is 1032

struct TiffCloser {
  void operator()(TIFF* file) const { TIFFClose(file); }
};
using TiffFile = std::unique_ptr<TIFF, TiffCloser>;

TiffFile OpenTiff(const fs::path& path, const char* mode) {
  TIFFSetWarningHandler(nullptr);
  TIFFSetErrorHandler(nullptr);
  return TiffFile(TIFFOpen(path.c_str(), mode));
}

constexpr const char* kMakeAgain = "Remove it; the program makes it again";

// libtiff only says that it failed; the system has said why.
[[noreturn]] void ThrowTiffError(const fs::path& path) {
  if (errno != 0) ThrowSystemError("cannot write the TIFF file", path);
  throw Error("cannot write the TIFF file", path.string());
}

void WritePage(TIFF* file, const Image<float>& page, const fs::path& path) {
  TIFFSetField(file, TIFFTAG_IMAGEWIDTH, std::uint32_t(page.width()));
  TIFFSetField(file, TIFFTAG_IMAGELENGTH, std::uint32_t(page.height()));
  TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 32);
  TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, 1);
  TIFFSetField(file, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
  TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  TIFFSetField(file, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(file, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
  TIFFSetField(file, TIFFTAG_ZIPQUALITY, 1);
  TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, 64u);
  bool good = true;
  std::vector<float> line(std::size_t(page.width()));  // libtiff may change the buffer that it is given
  for (int y = 0; good && y < page.height(); ++y) {
    std::copy_n(page.row(y), page.width(), line.begin());
    good = TIFFWriteScanline(file, line.data(), std::uint32_t(y)) == 1;
  }
  if (!good || TIFFWriteDirectory(file) != 1) ThrowTiffError(path);
}

Image<float> ReadPage(TIFF* file, const fs::path& path) {
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 0, samples = 1, format = 0;
  TIFFGetField(file, TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(file, TIFFTAG_IMAGELENGTH, &height);
  TIFFGetFieldDefaulted(file, TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLESPERPIXEL, &samples);
  TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLEFORMAT, &format);
  constexpr std::uint32_t kLargest = 1u << 16;
  if (width == 0 || height == 0 || width > kLargest || height > kLargest || bits != 32 || samples != 1 ||
      format != SAMPLEFORMAT_IEEEFP || TIFFScanlineSize64(file) != std::uint64_t(width) * 4)
    throw Error("this TIFF page is not grey float32", path.string());
  if (std::uint64_t(width) * height * sizeof(float) > kMostDeflated * fs::file_size(path))
    throw Error("the TIFF file promises more pixels than it can hold", path.string(), kMakeAgain);
  Image<float> page{int(width), int(height)};
  for (int y = 0; y < page.height(); ++y)
    if (TIFFReadScanline(file, page.row(y), std::uint32_t(y)) != 1)
      throw Error("the TIFF file is damaged or cut off", path.string(), kMakeAgain);
  return page;
}

}  // namespace

void WriteFloatTiff(const fs::path& path, const std::vector<const Image<float>*>& pages,
                    const std::string& description) {
  WriteAtomically(path, [&](const fs::path& temporary) {
    errno = 0;
    const TiffFile file = OpenTiff(temporary, "w");
    if (!file) ThrowTiffError(path);
    if (!description.empty()) TIFFSetField(file.get(), TIFFTAG_IMAGEDESCRIPTION, description.c_str());
    for (const Image<float>* page : pages) WritePage(file.get(), *page, path);
    if (TIFFFlush(file.get()) != 1) ThrowTiffError(path);
  });
}

std::vector<Image<float>> ReadFloatTiff(const fs::path& path, std::string* description) {
  const TiffFile file = OpenTiff(path, "r");
  if (!file) throw Error("this is not a TIFF file, or it is damaged", path.string());
  const char* text = nullptr;
  if (description && TIFFGetField(file.get(), TIFFTAG_IMAGEDESCRIPTION, &text) == 1 && text)
    *description = text;
  std::vector<Image<float>> pages;
  do {
    pages.push_back(ReadPage(file.get(), path));
    if (!SameSize(pages[0], pages.back()))
      throw Error("the pages of this TIFF file differ in size", path.string());
    if (TIFFLastDirectory(file.get())) return pages;
    if (TIFFReadDirectory(file.get()) != 1)
      throw Error("the TIFF file is cut off before its last page", path.string(), kMakeAgain);
  } while (pages.size() < 64);
  return pages;
}

}  // namespace polarscan
