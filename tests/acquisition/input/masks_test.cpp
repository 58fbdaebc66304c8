// SPDX-License-Identifier: Apache-2.0
// Masks as other programs save and name them.
#include "acquisition/input/masks.h"

#include <gtest/gtest.h>

#include <fstream>

#include "acquisition/session/import_export.h"
#include "core/formats/picture_tags.h"
#include "tests/acquisition/input/picture_bytes.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

class MasksTest : public PictureFolder {};

TEST_F(MasksTest, TheObjectIsWhereAMaskIsNotBlackWhateverItsDepthAndColours) {
  const std::string palette = Chunk("PLTE", "\0\0\0\0\0\x80"s), hidden = Chunk("tRNS", "\0"s);
  const std::map<std::string, std::string> masks = {
      {"one", Png(8, 0, Rows("\0"s, "\1"))},
      {"hundred", Png(8, 0, Rows("\0"s, "d"))},
      {"one bit", Png(1, 0, OneBitRows())},
      {"16 bit, 1", Png(16, 0, Rows("\0\0"s, "\0\1"s))},
      {"16 bit, 255", Png(16, 0, Rows("\0\0"s, "\0\xFF"s))},
      {"palette", Png(8, 3, Rows("\0"s, "\1"), palette)},
      {"palette with a transparent colour", Png(8, 3, Rows("\0"s, "\1"), palette + hidden)},
      {"blue", Png(8, 2, Rows("\0\0\0"s, "\0\0\x40"s))},
      {"green, opaque", Png(8, 6, Rows("\0\0\0\xFF"s, "\0\x80\0\xFF"s))},
      {"black, cut out", Png(8, 6, Rows("\0\0\0\0"s, "\0\0\0\xFF"s))},
      {"a picture, cut out", Png(8, 6, Rows("\x40\x50\x60\0"s, "\x40\x50\x60\xFF"s))},
      {"cut out by alpha 1", Png(8, 6, Rows("\xFF\xFF\xFF\0"s, "\xFF\xFF\xFF\1"s))},
      {"grey and alpha", Png(8, 4, Rows("\xFF\0"s, "\0\xFF"s))},
      {"grey, all of it transparent", Png(8, 4, Rows("\0\0"s, "\xFF\0"s))},
      {"16 bit grey and alpha", Png(16, 4, Rows("\0\0\0\0"s, "\0\0\xFF\xFF"s))}};
  for (const auto& [what, bytes] : masks) {
    Write("mask.png", bytes);
    ExpectObject(ReadMask(folder_ / "mask.png"), what);
  }
}

TEST_F(MasksTest, SoftMasksAreCutAtHalfOfTheirBrightestValueAndLabelsAreNot) {
  Image<std::uint8_t> soft(100, 100), labels(100, 100), shaded(100, 100);
  Image<Rgb8> noisy(100, 100);
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 100; ++x) {
      soft(x, y) = std::uint8_t(std::clamp(200 * (x - 30) / 20, 0, 200));  // half of it at 40
      labels(x, y) = std::uint8_t(x < 40 ? 0 : x < 45 ? 1 : 9);
      shaded(x, y) = std::uint8_t(x < 40 ? 0 : 1 + y);
      const auto value = std::uint8_t(x < 40 ? (x * 7 + y * 3) % 12 : 240);
      noisy(x, y) = {value, value, value};
    }
  WritePng(folder_ / "soft.png", soft);
  WritePng(folder_ / "labels.png", labels);
  WritePng(folder_ / "shaded.png", shaded);
  Write("noisy.jpg", EncodeJpeg(noisy, 90));
  for (const char* name : {"soft.png", "labels.png", "shaded.png", "noisy.jpg"}) {
    const Image<std::uint8_t> mask = ReadMask(folder_ / name);
    for (int y = 0; y < 100; ++y)
      for (int x = 0; x < 100; ++x)
        if (x < 39 || x > 40) {
          ASSERT_EQ(mask(x, y), x > 39 ? 255 : 0) << name << " " << x << " " << y;
        }
  }
}

TEST_F(MasksTest, AreFoundUnderTheNamesThatColmapAndOpenMvsWant) {
  for (const char* name : {"a.png", "b.png", "c.png", "d.png", "e.png", "f.png"}) Photo(name);
  const std::string mask = Png(8, 0, Rows("\0"s, "\1"));
  const std::vector<std::string> names = {"masks/a.png",      "masks/b.png.png", "masks/c.mask.png",
                                          "masks/d_mask.png", "e.mask.png",      "f.png.mask.png"};
  for (const std::string& name : names) Write(name, mask);
  const Input input = Open();
  ASSERT_EQ(input.views.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(input.views[i].mask, folder_ / names[i]);
    ExpectObject(ReadView(input, int(i)).mask, names[i]);
  }
  Write("masks/a.jpg.png", mask);
  EXPECT_THROW(Open(), Error);  // two masks of one view
}

TEST_F(MasksTest, MasksWithoutAPictureEmptyOnesAndFullOnesAreNamed) {
  for (const char* name : {"a.png", "b.png", "c.png"}) Photo(name);
  Write("masks/a.png", Png(8, 0, Rows("\0"s, "\1")));
  Write("masks/b.png", Png(8, 0, Rows("\0"s, "\0"s)));
  Write("masks/c.png", Png(8, 0, Rows("\5", "\5")));
  Write("masks/stranger.png", Png(8, 0, Rows("\0"s, "\1")));
  EXPECT_TELLS(Warnings(), "1 of 4 masks are of no picture here and not used: stranger.png");
  EXPECT_TELLS(Odd(), "1 of 3 masks are empty, nothing of these views is used: b");
  EXPECT_TELLS(Odd(), "1 of 3 masks are full, the whole picture counts as object: c");
  for (const char* name : {"masks/a.png", "masks/c.png"}) Write(name, Png(8, 0, Rows("\0"s, "\0"s)));
  EXPECT_TELLS(MaskError(), "all 3 masks are empty");
  const std::string rim(12, '\1'), hole = "\1\1"s + std::string(8, '\0') + "\1\1";
  for (const char* name : {"masks/a.png", "masks/b.png", "masks/c.png"})
    Write(name, Png(8, 0, {rim, rim, hole, hole, hole, hole, rim, rim}));
  EXPECT_TELLS(Odd(), "all masks are white along the borders and black in the middle: are they inverted?");
  Write("masks/b.png", Png(8, 0, Rows("\0"s, "\1")));
  EXPECT_FALSE(Odd().find("inverted") != std::string::npos) << "one mask's object is in the picture";
  Write("masks/a.png", Png(8, 0, {std::string(7, '\1')}, "", 7));
  EXPECT_TELLS(MaskError(), "the mask is 7x1, its picture 12x8");
}

TEST_F(MasksTest, FilesAmongTheMasksThatAreNotReadAreNamed) {
  Write("masks/a.gif", "GIF89a");
  for (const char* name : {"a.png", "b.png"}) Photo(name);
  EXPECT_NE(Warnings().find("in masks/: 1 .gif file is not read (a.gif)"), std::string::npos) << Warnings();
}

TEST_F(MasksTest, FollowTheExifOrientationOfTheirPictures) {
  Image<std::uint8_t> object(kWidth, kHeight);
  Image<Rgb8> coloured(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (InObject(x, y)) object(x, y) = 255, coloured(x, y) = {250, 250, 250};
  for (int orientation = 1; orientation <= 8; ++orientation) {
    Write("a.jpg", JpegWithExif(Image<Rgb8>(kWidth, kHeight, {200, 100, 50}), orientation));
    EXPECT_EQ(ReadPictureTags(folder_ / "a.jpg").orientation, orientation);
    WritePng(folder_ / "masks/a.png", AsShown(object, orientation));
    ExpectObject(ReadView(Open(), 0).mask, "as shown, " + std::to_string(orientation));
    EXPECT_EQ(Tells(Odd(), "EXIF orientation"), orientation > 1);
    if (orientation >= 5) {
      WritePng(folder_ / "masks/a.png", object);
      ExpectObject(ReadView(Open(), 0).mask, "as stored, " + std::to_string(orientation));
    }
    Write("masks/a.png", Png(8, 0, Rows("\0"s, "\1"), Chunk("eXIf", Exif(orientation))));
    ExpectObject(ReadView(Open(), 0).mask, "with the same tag, " + std::to_string(orientation));
    EXPECT_EQ(Odd(), "");
  }
  // Exif's own words: 6, "the 0th row is the visual right-hand side", so what is stored at the top left is
  // shown at the top right.
  Image<std::uint8_t> corner(kWidth, kHeight);
  corner(0, 0) = 255;
  EXPECT_EQ(AsShown(corner, 6)(kHeight - 1, 0), 255);
  EXPECT_EQ(AsShown(corner, 8)(0, kWidth - 1), 255);
  EXPECT_EQ(AsShown(corner, 3)(kWidth - 1, kHeight - 1), 255);
}

TEST_F(MasksTest, WhatIsTransparentInAPictureIsItsMaskIfThereIsNoOther) {
  Write("a.png", Png(8, 6, Rows("\x10\x20\x30\0"s, "\x10\x20\x30\xFF"s)));
  Write("b.png", Png(8, 6, Rows("\x10\x20\x30\xFF"s, "\x10\x20\x30\xFF"s)));
  const Input input = Open();
  ExpectObject(ReadView(input, 0).mask, "alpha");
  EXPECT_TRUE(ReadView(input, 1).mask.empty());
  EXPECT_TELLS(input.notes.at(0), "what is transparent in the pictures counts as their mask");
  Write("masks/a.png", Png(8, 0, Rows("\1", "\0"s)));
  EXPECT_EQ(ReadView(Open(), 0).mask(0, 0), 255);
}

TEST_F(MasksTest, PosesMasksAndWhatCountsMeanGoIntoASessionAndComeOutAgain) {
  const fs::path pictures = folder_ / "pictures", session = folder_ / "session", back = folder_ / "back";
  Write("pictures/mosaic/a.png", Png(8, 0, Rows("\x40", "\x50")));
  Write("pictures/mosaic/b.png", Png(8, 0, Rows("\x40", "\x50")));
  Write("pictures/masks/a.png", Png(8, 0, Rows("\0"s, "\1")));
  Write("pictures/mosaic/b.mask.png", Png(8, 0, Rows("\0"s, "\1")));
  Write("pictures/sparse/cameras.txt", "1 PINHOLE 12 8 10 10 6 4\n");
  Write("pictures/set.json", R"({"gamma": 2, "sensor": {"layout": "90 45 / 135 0", "black_dn": 3}})");
  const Input before = OpenInput(pictures, {});
  ImportSession(before, session, silent_);
  ExportSession(OpenSession(session), back, "tif", silent_);
  for (const fs::path& folder : {session, back}) {
    const Input after = OpenInput(folder, {});
    EXPECT_EQ(Meaning(after), Meaning(before)) << folder;
    ASSERT_EQ(after.views.size(), 2u);
    for (int i = 0; i < 2; ++i) ExpectObject(ReadView(after, i).mask, folder.string());
    EXPECT_EQ(ReadFile(folder / "sparse/cameras.txt"), "1 PINHOLE 12 8 10 10 6 4\n");
  }
}

}  // namespace
}  // namespace polarscan
