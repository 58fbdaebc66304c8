// SPDX-License-Identifier: Apache-2.0
#include "core/formats/picture_tags.h"

#include <tiffio.h>

#include <algorithm>
#include <cctype>
#include <memory>
#include <string>
#include <string_view>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// A number of `count` bytes; 0 beyond the end.
std::uint64_t WholeAt(std::string_view bytes, std::size_t at, int count, bool big_endian = true) {
  if (at > bytes.size() || bytes.size() - at < std::size_t(count)) return 0;
  std::uint64_t value = 0;
  for (int i = 0; i < count; ++i)
    value = value << 8 | static_cast<unsigned char>(bytes[at + std::size_t(big_endian ? i : count - 1 - i)]);
  return value;
}

// Of an EXIF block, which is the head of a TIFF file.
int ExifOrientation(std::string_view exif) {
  const std::optional<std::size_t> place = OrientationPlace(exif);
  const std::uint64_t value = place ? WholeAt(exif, *place, 2, exif.starts_with("MM")) : 1;
  return value >= 1 && value <= 8 ? int(value) : 1;
}

// Profiles are named in ASCII or UTF-16.
bool IsCalledLinear(std::string_view profile) {
  std::string letters;
  for (const char c : profile)
    if (c != 0) letters += char(std::tolower(static_cast<unsigned char>(c)));
  return letters.find("linear") != std::string::npos;
}

PictureTags PngTags(std::string_view bytes) {
  constexpr std::uint32_t kNearlyLinear = 90'000;  // a gamma of 0.9
  PictureTags tags;
  for (std::size_t at = 8; at + 8 <= bytes.size();) {
    const std::size_t length = WholeAt(bytes, at, 4);
    const std::string_view kind = bytes.substr(at + 4, 4), data = bytes.substr(at + 8, length);
    if (kind == "sRGB") tags.encoded = true;
    if (kind == "iCCP" && !IsCalledLinear(data.substr(0, data.find('\0')))) tags.encoded = true;
    if (kind == "gAMA" && WholeAt(data, 0, 4) < kNearlyLinear) tags.encoded = true;
    if (kind == "eXIf") tags.orientation = ExifOrientation(data);
    at += 12 + length;
  }
  return tags;
}

PictureTags JpegTags(std::string_view bytes) {
  using namespace std::string_view_literals;
  PictureTags tags;
  for (std::size_t at = 2; at + 4 <= bytes.size() && bytes[at] == '\xFF' && bytes[at + 1] != '\xDA';) {
    const std::size_t length = WholeAt(bytes, at + 2, 2);
    const std::string_view data = bytes.substr(at + 4, length);
    if (bytes[at + 1] == '\xE1' && data.starts_with("Exif\0\0"sv))
      tags.orientation = ExifOrientation(data.substr(6));
    at += 2 + std::max<std::size_t>(length, 2);
  }
  return tags;
}

PictureTags TiffTags(const fs::path& path) {
  TIFFSetWarningHandler(nullptr);
  TIFFSetErrorHandler(nullptr);
  const std::unique_ptr<TIFF, decltype(&TIFFClose)> file(TIFFOpen(path.c_str(), "r"), &TIFFClose);
  std::uint32_t length = 0;
  const char* profile = nullptr;
  PictureTags tags;
  std::uint16_t orientation = 1;
  if (file && TIFFGetField(file.get(), TIFFTAG_ORIENTATION, &orientation) == 1 && orientation >= 1 &&
      orientation <= 8)
    tags.orientation = orientation;
  if (file && TIFFGetField(file.get(), TIFFTAG_ICCPROFILE, &length, &profile) == 1 && profile)
    tags.encoded = !IsCalledLinear({profile, length});
  return tags;
}

// Calls f with the place in the stored picture that is shown at each place of the result.
template <class F>
void ForEachTurned(int width, int height, int orientation, F&& f) {
  const bool transposed = orientation >= 5;
  const bool right_to_left = orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const bool upside_down = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  for (int y = 0; y < (transposed ? width : height); ++y)
    for (int x = 0; x < (transposed ? height : width); ++x) {
      const int column = transposed ? y : x, row = transposed ? x : y;
      f(x, y, right_to_left ? width - 1 - column : column, upside_down ? height - 1 - row : row);
    }
}

}  // namespace

std::optional<std::size_t> OrientationPlace(std::string_view tiff) {
  constexpr std::uint64_t kOrientation = 0x0112, kBigTiff = 43;
  const bool big = tiff.starts_with("MM");
  if (!big && !tiff.starts_with("II")) return {};
  const bool wide = WholeAt(tiff, 2, 2, big) == kBigTiff;
  const int offset = wide ? 8 : 4, head = wide ? 8 : 2;
  const std::size_t begin = WholeAt(tiff, std::size_t(offset), offset, big), size = wide ? 20 : 12,
                    value = wide ? 12 : 8;
  const std::uint64_t count = std::min<std::uint64_t>(WholeAt(tiff, begin, head, big), tiff.size() / size);
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::size_t entry = begin + std::size_t(head) + size * i;
    if (entry + size > tiff.size()) break;
    if (WholeAt(tiff, entry, 2, big) == kOrientation) return entry + value;
  }
  return {};
}

PictureTags ReadPictureTags(const fs::path& path) {
  try {
    const std::string bytes = ReadFile(path);
    if (bytes.starts_with("\x89PNG")) return PngTags(bytes);
    if (bytes.starts_with("\xFF\xD8")) return JpegTags(bytes);
    if (bytes.starts_with("II") || bytes.starts_with("MM")) return TiffTags(path);
  } catch (const Error&) {  // whoever wants the pixels will say it
  }
  return {};
}

Image<std::uint8_t> AsShown(const Image<std::uint8_t>& stored, int orientation) {
  if (orientation == 1) return stored;
  const int width = stored.width(), height = stored.height();
  Image<std::uint8_t> shown(orientation >= 5 ? height : width, orientation >= 5 ? width : height);
  ForEachTurned(width, height, orientation,
                [&](int x, int y, int from_x, int from_y) { shown(x, y) = stored(from_x, from_y); });
  return shown;
}

Image<std::uint8_t> AsStored(const Image<std::uint8_t>& shown, int orientation) {
  if (orientation == 1) return shown;
  const int width = orientation >= 5 ? shown.height() : shown.width(),
            height = orientation >= 5 ? shown.width() : shown.height();
  Image<std::uint8_t> stored(width, height);
  ForEachTurned(width, height, orientation,
                [&](int x, int y, int to_x, int to_y) { stored(to_x, to_y) = shown(x, y); });
  return stored;
}

}  // namespace polarscan
