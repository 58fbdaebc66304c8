// SPDX-License-Identifier: Apache-2.0
// Pictures one by one: cut off, of another kind, with a false promise of their size, turned.
#include <cmath>
#include <utility>

#include "core/formats/picture_tags.h"
#include "input/input_folder.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

TEST_F(InputTest, ATruncatedPngIsNamed) {
  Angles({"000", "001"});
  const std::string bytes = ReadFile(folder_ / "I-45/001.png");
  WriteFileAtomically(folder_ / "I-45/001.png", bytes.substr(0, bytes.size() / 2));
  EXPECT_SAYS(Complaint(), "I-45/001.png");
  EXPECT_SAYS(Complaint(), "cut off");
}

TEST_F(InputTest, APictureOfAnotherKindIsNotGivenToWhoeverKnowsIt) {
  WriteFileAtomically(folder_ / "a.tif", std::string("GDAL or whatever") + std::string(200, 'x'));
  EXPECT_THROW(ReadPicture(folder_ / "a.tif"), Error);
  for (const char* name : {"b.tif", "b.png"}) {
    WriteFileAtomically(folder_ / name, EncodeJpeg(Image<Rgb8>(8, 8), 90));  // whatever it is called
    EXPECT_EQ(ReadPicture(folder_ / name).width(), 8);
  }
  WriteFileAtomically(folder_ / "c.png", "hello");
  WriteFileAtomically(folder_ / "d.pgm", "P5 70000 1 255\n" + std::string(70000, 'x'));
  for (const auto& [name, words] : {std::pair("c.png", "of another kind"), {"d.pgm", "70000 x 1"}}) {
    try {
      ReadPicture(folder_ / name);
      FAIL() << name;
    } catch (const Error& error) {
      EXPECT_SAYS(std::string(error.what()), words);
    }
  }
}

TEST_F(InputTest, APictureWithPixelsThatAreNoNumbersHasNoColoursForThat) {
  Image<float> page(8, 6, 0.5f);
  page(3, 2) = NAN;
  WriteFloatTiff(folder_ / "a.tif", {&page});
  EXPECT_TRUE(IsGrey(ReadPicture(folder_ / "a.tif")));
}

TEST_F(InputTest, APictureThatPromisesMoreThanItsFileCanHoldIsRefused) {
  std::string bytes = EncodeJpeg(Image<Rgb8>(8, 8), 90);
  const std::size_t size = bytes.find("\xFF\xC0") + 5;  // height, width
  bytes[size] = bytes[size + 2] = 0x20;
  WriteFileAtomically(folder_ / "a.jpg", bytes);
  try {
    ReadPicture(folder_ / "a.jpg");
    FAIL();
  } catch (const Error& error) {
    EXPECT_SAYS(std::string(error.what()), "promises more pixels");
  }
}

// What is left of these files cannot be decoded: that it is not tried is seen in the message.
TEST_F(InputTest, APromiseOfTooManyPixelsIsFoundBeforeMemoryIsTakenForThem) {
  std::string jpeg = EncodeJpeg(Image<Rgb8>(8, 8), 90);
  const std::size_t size = jpeg.find("\xFF\xC0") + 5;
  jpeg[size] = jpeg[size + 2] = 0x20;
  WriteFileAtomically(folder_ / "a.jpg", jpeg.substr(0, size + 12) + "\xFF\xD9");
  WritePng(folder_ / "b.png", Image<std::uint8_t>(8, 8));
  std::string png = ReadFile(folder_ / "b.png");
  png[18] = png[22] = 0x20;
  WriteFileAtomically(folder_ / "b.png", png);  // its checksum is wrong now
  const auto tag = [](int number, int value) {  // of a TIFF, one long
    const auto u = [](int n) { return std::string{char(n), char(n >> 8), char(n >> 16), char(n >> 24)}; };
    return u(number).substr(0, 2) + u(4).substr(0, 2) + u(1) + u(value);
  };
  WriteFileAtomically(folder_ / "c.tif", std::string("II*\0\x08\0\0\0\x04\0", 10) + tag(256, 100'000'000) +
                                             tag(257, 7) + tag(273, 8) + tag(279, 4) + std::string(4, '\0'));
  for (const char* name : {"a.jpg", "b.png", "c.tif"}) {
    try {
      ReadPicture(folder_ / name);
      FAIL();
    } catch (const Error& error) {
      EXPECT_SAYS(std::string(error.what()), "promises more pixels");
    }
  }
}

// A grey 8-bit TIFF of one strip with the tag Orientation, written by hand.
std::string TiffWithOrientation(const Image<std::uint8_t>& image, std::uint16_t orientation, bool big) {
  std::string bytes = big ? "MM" : "II";
  const auto put = [&](std::uint32_t value, int count) {
    for (int i = 0; i < count; ++i) bytes += char(value >> 8 * (big ? count - 1 - i : i));
  };
  put(42, 2), put(std::uint32_t(8 + image.size()), 4);
  for (const std::uint8_t pixel : image.pixels()) bytes += char(pixel);
  const std::pair<std::uint16_t, std::uint32_t> entries[] = {{256, image.width()},
                                                             {257, image.height()},
                                                             {258, 8},
                                                             {259, 1},
                                                             {262, 1},
                                                             {273, 8},
                                                             {274, orientation},
                                                             {277, 1},
                                                             {278, image.height()},
                                                             {279, std::uint32_t(image.size())}};
  put(std::size(entries), 2);
  for (const auto& [tag, value] : entries) {
    const bool is_long = tag == 273 || tag == 279;
    put(tag, 2), put(is_long ? 4 : 3, 2), put(1, 4);
    put(value, is_long ? 4 : 2);
    if (!is_long) put(0, 2);
  }
  put(0, 4);
  return bytes;
}

TEST_F(InputTest, TiffIsReadAsItIsStoredWhateverItsOrientationSays) {
  Image<std::uint8_t> image(8, 6);
  for (std::size_t i = 0; i < image.size(); ++i) image.pixels()[i] = std::uint8_t(5 * i);
  for (const bool big : {false, true})
    for (std::uint16_t orientation = 1; orientation <= 8; ++orientation) {
      WriteFileAtomically(folder_ / "a.tif", TiffWithOrientation(image, orientation, big));
      const Picture picture = ReadPicture(folder_ / "a.tif");
      ASSERT_EQ(picture.width(), 8) << orientation;
      for (std::size_t i = 0; i < image.size(); ++i)
        ASSERT_EQ(picture.planes[0].pixels()[i], float(image.pixels()[i])) << orientation << " " << i;
      EXPECT_EQ(ReadPictureTags(folder_ / "a.tif").orientation, orientation);
    }
}

}  // namespace
}  // namespace polarscan
