// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string_view>

#include "core/image.h"

namespace polarscan {

// What a picture file says of its pixels beside them. ReadPicture follows none of it.
struct PictureTags {
  // EXIF's, or a TIFF's own: 1 to 8, how the rows as stored are to be turned to be shown; 1: not at all.
  int orientation = 1;
  // A PNG with sRGB, with a gamma below 1 or with a profile, or a TIFF with a profile, that is not called
  // linear: its values are not linear in light.
  bool encoded = false;
};

// The place of the two bytes that hold the tag Orientation of a TIFF's first picture, or of an EXIF block,
// which is the head of a TIFF; none if there is no such tag.
std::optional<std::size_t> OrientationPlace(std::string_view tiff);

// Nothing is said in files that are missing, damaged or of another kind.
PictureTags ReadPictureTags(const std::filesystem::path& path);

// A picture as it is to be shown, from one as stored, by EXIF's orientation; and the way back.
Image<std::uint8_t> AsShown(const Image<std::uint8_t>& stored, int orientation);
Image<std::uint8_t> AsStored(const Image<std::uint8_t>& shown, int orientation);

}  // namespace polarscan
