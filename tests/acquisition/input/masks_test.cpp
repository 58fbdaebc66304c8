// SPDX-License-Identifier: Apache-2.0
// Masks as other programs save and name them, and what pictures say of themselves. The files are made here
// byte by byte: nothing of the program's own writers or of its picture library is in them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "acquisition/input/masks.h"
#include "acquisition/session/import_export.h"
#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/picture_tags.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
using namespace std::string_literals;

constexpr int kWidth = 12, kHeight = 8;

bool InObject(int x, int y) { return x >= 3 && x < 9 && y >= 2 && y < 5; }

std::string BigEndian(std::uint32_t value, int bytes = 4) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text += char(value >> (8 * i));
  return text;
}

std::string Chunk(const std::string& kind, const std::string& data) {
  std::uint32_t crc = ~0u;
  for (const char c : kind + data) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? crc >> 1 ^ 0xEDB88320u : crc >> 1;
  }
  return BigEndian(std::uint32_t(data.size())) + kind + data + BigEndian(~crc);
}

// A PNG of these rows; colour: 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGBA. more: chunks before the
// rows.
std::string Png(int bits, int colour, const std::vector<std::string>& rows, const std::string& more = "",
                int width = kWidth) {
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
std::vector<std::string> Rows(const std::string& outside, const std::string& object) {
  std::vector<std::string> rows;
  for (int y = 0; y < kHeight; ++y) {
    rows.emplace_back();
    for (int x = 0; x < kWidth; ++x) rows.back() += InObject(x, y) ? object : outside;
  }
  return rows;
}

std::vector<std::string> OneBitRows() {
  std::vector<std::string> rows;
  for (int y = 0; y < kHeight; ++y) {
    rows.emplace_back(2, '\0');
    for (int x = 0; x < kWidth; ++x)
      if (InObject(x, y)) rows.back()[std::size_t(x / 8)] |= char(0x80 >> x % 8);
  }
  return rows;
}

std::string Exif(int orientation) {
  return "MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"s + char(orientation) + "\0\0\0\0\0\0"s;
}

std::string JpegWithExif(const Image<Rgb8>& picture, int orientation) {
  const std::string block = "Exif\0\0"s + Exif(orientation);
  return EncodeJpeg(picture, 95)
      .insert(2, "\xFF\xE1" + BigEndian(std::uint32_t(block.size()) + 2, 2) + block);
}

class MasksTest : public testing::Test {
 protected:
  MasksTest() {
    std::string name = (fs::temp_directory_path() / "polarscan-masks-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~MasksTest() override { fs::remove_all(folder_); }

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

  fs::path folder_;
  Progress silent_;
};

void ExpectObject(const Image<std::uint8_t>& mask, const std::string& what) {
  ASSERT_EQ(mask.width(), kWidth) << what;
  ASSERT_EQ(mask.height(), kHeight) << what;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      ASSERT_EQ(mask(x, y), InObject(x, y) ? 255 : 0) << what << " " << x << " " << y;
}

bool Tells(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }
#define EXPECT_TELLS(text, part) EXPECT_PRED2(Tells, text, part)

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

// Edges of half a brightest value, and noise of a JPEG near black: the object is as large as with a hard
// edge.
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

// A picture that is stored on its side: the mask may be made from it as shown, as stored, or with the same
// tag.
TEST_F(MasksTest, FilesAmongTheMasksThatAreNotReadAreNamed) {
  Write("masks/a.gif", "GIF89a");
  for (const char* name : {"a.png", "b.png"}) Photo(name);
  EXPECT_NE(Warnings().find("in masks/: 1 .gif file is not read (a.gif)"), std::string::npos) << Warnings();
}

TEST_F(MasksTest, AnglesOfPolarizationThatEndLongBeforeHalfATurnAreWarnedOf) {
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

TEST_F(MasksTest, PicturesThatSayThatTheyAreCodedForShowingAreNotTakenAsLinearWithoutAWord) {
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

TEST_F(MasksTest, SixteenBitPhotosThatSayThatTheyAreCodedForShowingAreNamed) {
  const auto rows = Rows("\x40\0\x50\0\x60\0"s, "\x60\0\x50\0\x40\0"s);
  Write("a.png", Png(16, 2, rows, Chunk("sRGB", "\0"s)));
  EXPECT_TELLS(Warnings(), "a.png says that its values are coded for showing");
  EXPECT_EQ(Warnings({.gamma = 2.2}), "");
  Write("a.png", Png(16, 2, rows));
  EXPECT_EQ(Warnings(), "");
}

TEST_F(MasksTest, AnglesOfPolarizationAsJpegAreWarnedOf) {
  Photo("rgb/a.png");
  Photo("dop/a.png");
  Write("aop/a.jpg", EncodeJpeg(Image<Rgb8>(kWidth, kHeight, {9, 9, 9}), 95));
  EXPECT_TELLS(Warnings(), "1 of 1 pictures in aop/ are JPEG");
  fs::remove(folder_ / "aop/a.jpg");
  Photo("aop/a.png");
  EXPECT_EQ(Warnings(), "");
}

TEST_F(MasksTest, MoreBitsOrAHigherWhiteLevelThanTheFilesHoldAreWarnedOf) {
  Write("mosaic/a.png", Png(8, 0, Rows("\x40", "\x50")));
  EXPECT_TELLS(Warnings({.layout = "90 45 / 135 0", .bits = 12}), "these pictures hold 8 bits, not 12");
  EXPECT_TELLS(Warnings({.layout = "90 45 / 135 0", .white_level = 4000}), "reaches the white level 4000");
  EXPECT_EQ(Warnings({.layout = "90 45 / 135 0", .bits = 8, .white_level = 250}), "");
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
