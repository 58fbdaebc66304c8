// SPDX-License-Identifier: Apache-2.0
#include "demosaic/sensor/pixel_format.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/error.h"
#include "core/random.h"

namespace polarscan {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Samples = std::vector<std::uint16_t>;

Samples UnpackRow(const std::string& format, const Bytes& bytes, int width) {
  const auto image = Unpack(ParsePixelFormat(format), bytes, width, 1);
  return {image.pixels().begin(), image.pixels().end()};
}

Image<std::uint16_t> Ramp(int width, int height, int bits) {
  Image<std::uint16_t> image(width, height);
  Random random(std::uint64_t(width * 100 + bits));
  for (std::uint16_t& sample : image.pixels()) sample = std::uint16_t(random.Below(1u << bits));
  return image;
}

// The vectors were worked out by hand from the figures of PFNC 2.4 and GigE Vision 2.0.
TEST(PixelFormat, Mono8IsOneByteASample) {
  EXPECT_EQ(UnpackRow("Mono8", {0, 7, 255}, 3), (Samples{0, 7, 255}));
}

TEST(PixelFormat, Mono10Mono12AndMono16AreLittleEndianWords) {
  for (const char* name : {"Mono10", "Mono12", "Mono14", "Mono16"})
    EXPECT_EQ(UnpackRow(name, {0x34, 0x02, 0xFF, 0x03}, 2), (Samples{0x234, 0x3FF})) << name;
  EXPECT_EQ(UnpackRow("Mono16", {0xCD, 0xAB}, 1), (Samples{0xABCD}));
}

TEST(PixelFormat, Mono12pHasTheLowBitsFirst) {
  EXPECT_EQ(UnpackRow("Mono12p", {0xBC, 0x3A, 0x12}, 2), (Samples{0xABC, 0x123}));
}

TEST(PixelFormat, Mono12PackedHasTheHighBitsOutside) {
  EXPECT_EQ(UnpackRow("Mono12Packed", {0xAB, 0x3C, 0x12}, 2), (Samples{0xABC, 0x123}));
}

TEST(PixelFormat, Mono10pHasFourSamplesInFiveBytes) {
  // 0x3FF, 0, 0x201, 0x155 from the lowest bit on
  EXPECT_EQ(UnpackRow("Mono10p", {0xFF, 0x03, 0x10, 0x60, 0x55}, 4), (Samples{0x3FF, 0, 0x201, 0x155}));
}

// From the tables of the kernel's documentation of V4L2_PIX_FMT_Y10P, Y12P, SRGGB14P.
TEST(PixelFormat, MipiFormatsHaveTheHighBitsOfAGroupBeforeItsLowBits) {
  EXPECT_EQ(UnpackRow("Mono10csi2p", {0xFF, 0x00, 0x80, 0x55, 0b01'10'00'11}, 4),
            (Samples{0x3FF, 0x000, 0x202, 0x155}));
  EXPECT_EQ(UnpackRow("BayerRG12csi2p", {0xAB, 0x12, 0x3C}, 2), (Samples{0xABC, 0x123}));
  EXPECT_EQ(UnpackRow("Mono14csi2p", {0x80, 0x01, 0xFF, 0x00, 0b01'100001, 0b1110'0100, 0b111111'00}, 4),
            (Samples{0x80 << 6 | 0b100001, 0x01 << 6 | 0b010001, 0xFF << 6 | 0b001110, 0b111111}));
}

// A row that ends within a group takes the whole group, as drivers lay it out.
TEST(PixelFormat, RowsOfMipiFormatsAreWholeGroups) {
  EXPECT_EQ(RowBytes(ParsePixelFormat("Mono10csi2p"), 5), 10u);
  EXPECT_EQ(RowBytes(ParsePixelFormat("Mono12csi2p"), 3), 6u);
  EXPECT_EQ(RowBytes(ParsePixelFormat("Mono14csi2p"), 8), 14u);
  const Bytes two_rows = {1, 2, 3, 4, 0, 5, 0, 0, 0, 0, 6, 7, 8, 9, 0, 10, 0, 0, 0, 0};
  const auto image = Unpack(ParsePixelFormat("Mono10csi2p"), two_rows, 5, 2, 10);
  EXPECT_EQ(image(4, 0), 5 << 2);
  EXPECT_EQ(image(4, 1), 10 << 2);
}

TEST(PixelFormat, BayerAndPolarizeNamesPackAsMonoAndNameTheirColours) {
  EXPECT_EQ(UnpackRow("BayerRG12p", {0xBC, 0x3A, 0x12}, 2), (Samples{0xABC, 0x123}));
  EXPECT_EQ(UnpackRow("PolarizeMono12Packed", {0xAB, 0x3C, 0x12}, 2), (Samples{0xABC, 0x123}));
  EXPECT_EQ(ParsePixelFormat("BayerGB8").bayer, "gbrg");
  EXPECT_EQ(ParsePixelFormat("PolarizeMono8").bayer, "");
}

TEST(PixelFormat, VendorsNamesOfPolarizedFormatsAreTheirPlainOnes) {
  for (const auto& [vendors, plain] :
       {std::pair{"PolarizeMono12p", "Mono12p"}, std::pair{"Polarized8", "Mono8"},
        std::pair{"Polarized10p", "Mono10p"}, std::pair{"BayerRGPolarized12p", "BayerRG12p"},
        std::pair{"PolarizedMono12Packed", "Mono12Packed"}, std::pair{"PolarizedBayerBG8", "BayerBG8"}}) {
    const PixelFormat a = ParsePixelFormat(vendors), b = ParsePixelFormat(plain);
    EXPECT_EQ(a.name, vendors);
    EXPECT_TRUE(a.bits == b.bits && a.packing == b.packing && a.bayer == b.bayer) << vendors;
  }
  for (const char* processed :
       {"PolarizedAngles_0d_45d_90d_135d_Mono8", "PolarizedDolpAolp_Mono8", "Polarized"})
    EXPECT_FALSE(FindPixelFormat(processed)) << processed;
}

TEST(PixelFormat, WhatIsPackedComesBackForEverySizeAndFormat) {
  for (const char* depth :
       {"8", "10", "12", "14", "16", "10p", "12p", "12Packed", "10csi2p", "12csi2p", "14csi2p"}) {
    const PixelFormat format = ParsePixelFormat(std::string("Mono") + depth);
    for (int width = 1; width < 12; ++width)
      for (int height = 1; height < 4; ++height) {
        const auto picture = Ramp(width, height, format.bits);
        const Bytes bytes = Pack(format, picture);
        ASSERT_EQ(bytes.size(), PayloadBytes(format, width, height));
        const auto again = Unpack(format, bytes, width, height);
        ASSERT_TRUE(std::ranges::equal(again.pixels(), picture.pixels())) << depth << " " << width;
      }
  }
}

TEST(PixelFormat, PaddingAfterEachRowIsSkipped) {
  const PixelFormat format = ParsePixelFormat("Mono12p");
  const Bytes bytes = {0xBC, 0x3A, 0x12, 0xEE, 0xEE, 0x01, 0x20, 0x00};
  const auto image = Unpack(format, bytes, 2, 2, 5);
  EXPECT_EQ(image(0, 0), 0xABC);
  EXPECT_EQ(image(0, 1), 0x001);
  EXPECT_EQ(image(1, 1), 0x002);
}

TEST(PixelFormat, AShortPayloadIsRefused) {
  for (const char* name : {"Mono8", "Mono12", "Mono10p", "Mono12p", "Mono12Packed"}) {
    const PixelFormat format = ParsePixelFormat(name);
    Bytes bytes(PayloadBytes(format, 6, 4));
    EXPECT_NO_THROW(Unpack(format, bytes, 6, 4)) << name;
    bytes.pop_back();
    EXPECT_THROW(Unpack(format, bytes, 6, 4), Error) << name;
    EXPECT_THROW(Unpack(format, bytes, 6, 2, 5), Error) << name << ": the stride is shorter than a row";
  }
}

TEST(PixelFormat, AnUnknownNameIsAnErrorThatShowsARightOne) {
  for (const char* name :
       {"", "Mono", "Mono9", "RGB8", "mono8", "PolarizedAngles_0d_45d_90d_135d_Mono8", "Mono12pp"})
    try {
      ParsePixelFormat(name);
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("Mono12p"), std::string::npos);
    }
}

TEST(PixelFormat, ASizeThatNoPictureHasIsAnError) {
  const Bytes bytes(64);
  const PixelFormat format = ParsePixelFormat("Mono8");
  for (const auto& [width, height] : {std::pair{-1, 8}, {8, -1}, {0, 8}, {8, 0}, {1 << 21, 1}})
    EXPECT_THROW(Unpack(format, bytes, width, height), Error) << width << " x " << height;
  EXPECT_THROW(Unpack(format, bytes, 2, 2, std::size_t(-2)), Error);
}

}  // namespace
}  // namespace polarscan
