// SPDX-License-Identifier: Apache-2.0
// What pictures say of themselves, and what is said of it.
#include <gtest/gtest.h>

#include "acquisition/input/remarks.h"
#include "tests/acquisition/input/picture_bytes.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

class PictureRemarks : public PictureFolder {};

TEST_F(PictureRemarks, AnglesOfPolarizationThatEndLongBeforeHalfATurnAreWarnedOf) {
  const auto warns = [&](int most, const std::string& scale) {
    for (const char* folder : {"rgb", "aop", "dop"})
      for (const char* view : {"/a.png", "/b.png"}) {
        Image<std::uint8_t> picture(16, 12);
        for (int y = 0; y < 12; ++y)
          for (int x = 0; x < 16; ++x) picture(x, y) = std::uint8_t((x + 16 * y) * most / 191);
        WritePng(folder_ / (std::string(folder) + view), picture);
      }
    InputOptions options;
    options.aop_scale = scale;
    return Warnings(options).find("--aop-scale degrees") != std::string::npos;
  };
  EXPECT_TRUE(warns(179, "auto"));
  EXPECT_FALSE(warns(254, "auto"));
  EXPECT_FALSE(warns(179, "half-turn"));
}

TEST_F(PictureRemarks, PicturesThatSayThatTheyAreCodedForShowingAreNotTakenAsLinearWithoutAWord) {
  const std::string srgb = Chunk("sRGB", "\0"s), gamma = Chunk("gAMA", BigEndian(45455)),
                    linear = Chunk("gAMA", BigEndian(100000)),
                    profile = Chunk("iCCP", "Adobe RGB\0\0"s + "anything");
  for (const std::string& chunk : {srgb, gamma, profile, linear, ""s}) {
    for (const char* angle : {"0", "45", "90", "135"})
      Write(angle + "/a.png"s, Png(8, 0, Rows("\x40", "\x50"), chunk));
    const bool told = !chunk.empty() && chunk != linear;
    EXPECT_EQ(Tells(Warnings(), "coded for showing"), told) << chunk;
    EXPECT_EQ(Open().notes.empty(), told) << chunk;  // else that it cannot be known
    EXPECT_EQ(Warnings({.gamma = 2.2}), "");
  }
}

TEST_F(PictureRemarks, SixteenBitPhotosThatSayThatTheyAreCodedForShowingAreNamed) {
  const auto rows = Rows("\x40\0\x50\0\x60\0"s, "\x60\0\x50\0\x40\0"s);
  Write("a.png", Png(16, 2, rows, Chunk("sRGB", "\0"s)));
  EXPECT_TELLS(Warnings(), "a.png says that its values are coded for showing");
  EXPECT_EQ(Warnings({.gamma = 2.2}), "");
  Write("a.png", Png(16, 2, rows));
  EXPECT_EQ(Warnings(), "");
}

TEST_F(PictureRemarks, AnglesOfPolarizationAsJpegAreWarnedOf) {
  Photo("rgb/a.png");
  Photo("dop/a.png");
  Write("aop/a.jpg", EncodeJpeg(Image<Rgb8>(kWidth, kHeight, {9, 9, 9}), 95));
  EXPECT_TELLS(Warnings(), "1 of 1 pictures in aop/ are JPEG");
  fs::remove(folder_ / "aop/a.jpg");
  Photo("aop/a.png");
  EXPECT_EQ(Warnings(), "");
}

TEST_F(PictureRemarks, MoreBitsOrAHigherWhiteLevelThanTheFilesHoldAreWarnedOf) {
  Write("mosaic/a.png", Png(8, 0, Rows("\x40", "\x50")));
  EXPECT_TELLS(Warnings({.layout = "90 45 / 135 0", .bits = 12}), "these pictures hold 8 bits, not 12");
  EXPECT_TELLS(Warnings({.layout = "90 45 / 135 0", .white_level = 4000}), "reaches the white level 4000");
  EXPECT_EQ(Warnings({.layout = "90 45 / 135 0", .bits = 8, .white_level = 250}), "");
}

}  // namespace
}  // namespace polarscan
