// SPDX-License-Identifier: Apache-2.0
// The forms that pictures come in: BMP, PGM, pages and channels of a TIFF, angles, sums, numpy's arrays.
#include <fmt/format.h>

#include <utility>

#include "input/input_forms.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

template <class T>
std::string Bytes(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

// A page of a TIFF: what every pixel's samples are, 16 bits each.
struct Page {
  int width = 8, height = 6;
  std::vector<std::uint16_t> samples = {100};
  int photometric = 1;  // 1: grey, 2: RGB
  bool is_preview = false;
};

// An uncompressed TIFF as its specification says, written without the library that reads it.
std::string Tiff(const std::vector<Page>& pages) {
  std::string file = std::string("II*\0", 4) + Bytes(std::uint32_t(8));
  for (std::size_t p = 0; p < pages.size(); ++p) {
    const Page& page = pages[p];
    std::string pixels;
    for (int i = 0; i < page.width * page.height; ++i)
      for (const std::uint16_t sample : page.samples) pixels += Bytes(sample);
    std::vector<std::pair<int, std::uint32_t>> tags = {{254, page.is_preview ? 1 : 0},
                                                       {256, std::uint32_t(page.width)},
                                                       {257, std::uint32_t(page.height)},
                                                       {258, 16},
                                                       {259, 1},
                                                       {262, std::uint32_t(page.photometric)},
                                                       {273, 0},
                                                       {277, std::uint32_t(page.samples.size())},
                                                       {278, std::uint32_t(page.height)},
                                                       {279, std::uint32_t(pixels.size())}};
    const std::size_t samples = page.samples.size(), extra = samples - (page.photometric == 2 ? 3 : 1);
    const std::size_t entries = tags.size() + (extra ? 1 : 0);
    const auto depths = std::uint32_t(file.size() + 2 + 12 * entries + 4),
               kinds = std::uint32_t(depths + 2 * samples);
    const std::uint32_t data = kinds + 2 * std::uint32_t(extra);
    file += Bytes(std::uint16_t(entries));
    for (auto [tag, value] : tags) {
      if (tag == 273) value = data;
      const std::uint32_t count = tag == 258 ? std::uint32_t(samples) : 1;
      if (tag == 258 && samples > 2) value = depths;
      if (tag == 258 && samples == 2) value = 16 | 16 << 16;
      file +=
          Bytes(std::uint16_t(tag)) + Bytes(std::uint16_t(tag == 258 ? 3 : 4)) + Bytes(count) + Bytes(value);
    }
    if (extra)  // kinds of the extra samples: nothing is said, or opacity
      file += Bytes(std::uint16_t(338)) + Bytes(std::uint16_t(3)) + Bytes(std::uint32_t(extra)) +
              (extra > 2 ? Bytes(kinds) : Bytes(std::uint32_t(page.photometric == 2 ? 2 : 0)));
    file += Bytes(p + 1 < pages.size() ? data + std::uint32_t(pixels.size()) : 0u);
    for (std::size_t s = 0; s < samples; ++s) file += Bytes(std::uint16_t(16));
    for (std::size_t s = 0; s < extra; ++s) file += Bytes(std::uint16_t(0));
    file += pixels;
  }
  return file;
}

// What numpy.save writes.
template <class T>
std::string Npy(const std::string& type, const std::string& shape, const std::vector<T>& values) {
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': {}, }}", type, shape);
  header.resize((10 + header.size() + 64) / 64 * 64 - 11, ' ');
  header += '\n';
  std::string file = std::string("\x93NUMPY\x01\0", 8) + Bytes(std::uint16_t(header.size())) + header;
  for (const T value : values) file += Bytes(value);
  return file;
}

TEST_F(InputFormsTest, BmpAndPgmOf8And16BitsAreRead) {
  std::string rows;
  for (int y = 0; y < 6; ++y) rows += std::string(8 * 3, char(90));  // 8 pixels of 3 bytes: no padding
  File("mosaic/a.bmp", "BM" + Bytes(std::uint32_t(54 + rows.size())) + Bytes(0u) + Bytes(54u) + Bytes(40u) +
                           Bytes(8) + Bytes(6) + Bytes(std::uint16_t(1)) + Bytes(std::uint16_t(24)) +
                           Bytes(0u) + Bytes(std::uint32_t(rows.size())) + Bytes(2835) + Bytes(2835) +
                           Bytes(0u) + Bytes(0u) + rows);
  File("mosaic/b.pgm", "P5\n# from a camera\n8 6\n255\n" + std::string(48, char(91)));
  const Input input = OpenMosaics();
  EXPECT_EQ(Names(input), (List{"a", "b"}));
  EXPECT_EQ(ValueOf(input, 0), 90);
  EXPECT_EQ(ValueOf(input, 1), 91);
  EXPECT_TRUE(input.warnings.empty()) << Joined(input.warnings);

  fs::remove_all(folder_ / "mosaic");
  std::string deep;
  for (int i = 0; i < 48; ++i) deep += "\x0F\xA0";  // 4000, the high byte first
  File("c.pgm", "P5 8 6 65535\n" + deep);
  const Input of_16 = OpenInput(folder_, {.layout = kSony, .bits = 12});
  EXPECT_EQ(ValueOf(of_16, 0), 4000);
  File("c.pgm", "P5 8 6 65535\n" + deep.substr(1));
  EXPECT_SAYS(Complaint({.layout = kSony, .bits = 12}), "cut off");
}

TEST_F(InputFormsTest, EveryPageOfATiffIsAMosaicOfItsOwn) {
  std::vector<Page> pages;
  for (int k = 0; k < 5; ++k) pages.push_back({8, 6, {std::uint16_t(100 + k)}});
  pages.push_back({4, 3, {7}, 1, true});  // a preview counts as none
  File("mosaic/run.tif", Tiff(pages));
  const Input input = OpenInput(folder_, {.layout = kSony, .bits = 12});
  EXPECT_EQ(Names(input), (List{"run-000", "run-001", "run-002", "run-003", "run-004"}));
  for (int k = 0; k < 5; ++k) EXPECT_EQ(ValueOf(input, k), 100 + k);
  EXPECT_SAYS(Joined(input.notes), "run.tif has 5 pages");

  pages[3].height = 4;
  File("mosaic/run.tif", Tiff(pages));
  EXPECT_SAYS(Complaint({.layout = kSony, .bits = 12}), "page 3");
}

TEST_F(InputFormsTest, ATiffWithAChannelOrPageAnAngleIsNeverTakenForAMosaic) {
  const InputOptions mosaics = {.layout = kSony, .bits = 12};
  File("a.tif", Tiff({{8, 6, {10, 45, 90, 135}}}));
  EXPECT_SAYS(Complaint(mosaics), "--input-kind angles");
  EXPECT_SAYS(Complaint({.kind = "mosaic", .layout = kSony, .bits = 12}), "--input-kind angles");
  const Input channels = Open({.kind = "angles", .bits = 12});
  EXPECT_EQ(ReadView(channels, 0).pictures.size(), 4u);
  EXPECT_EQ(ValueOf(channels, 0, 2), 90);
  EXPECT_SAYS(Joined(channels.notes), "0 45 90 135");

  for (int i = 0; i < 4; ++i) fs::copy_file(folder_ / "a.tif", folder_ / fmt::format("{}.tif", i));
  EXPECT_EQ(Open({.kind = "angles", .bits = 12}).views.size(), 5u);  // the name 0 is no angle here
  for (int i = 0; i < 4; ++i) fs::remove(folder_ / fmt::format("{}.tif", i));

  fs::create_directories(folder_ / "mosaic");  // where the error that names --input-kind angles was met
  fs::rename(folder_ / "a.tif", folder_ / "mosaic/a.tif");
  EXPECT_SAYS(Complaint(mosaics), "--input-kind angles");
  EXPECT_EQ(ValueOf(Open({.kind = "angles", .bits = 12}), 0, 3), 135);
  fs::remove_all(folder_ / "mosaic");

  File("a.tif", Tiff({{8, 6, {10}}, {8, 6, {45}}, {8, 6, {90}}, {8, 6, {135}}}));
  EXPECT_SAYS(Complaint(mosaics), "--input-kind angles");
  EXPECT_EQ(ValueOf(Open({.kind = "angles", .bits = 12}), 0, 1), 45);
  EXPECT_EQ(OpenInput(folder_, {.kind = "mosaic", .layout = kSony, .bits = 12}).views.size(), 4u);

  File("a.tif", Tiff({{8, 6, {10, 45, 90, 135}, 2}}));  // red, green, blue, opacity
  EXPECT_SAYS(Complaint({.kind = "angles", .bits = 12}), "marked as red, green, blue");
  EXPECT_EQ(ValueOf(Open({.kind = "angles", .bits = 12, .angles = "90,45,0,135"}), 0, 3), 135);
  EXPECT_EQ(Open({.kind = "photos"}).views.size(), 1u);
}

TEST_F(InputFormsTest, AnyThreeAnglesByFolderOrName) {
  const auto check = [&](const InputOptions& options, const std::vector<double>& angles,
                         const std::string& name) {
    const Input input = Open(options);
    EXPECT_EQ(input.kind, InputKind::kAngles);
    EXPECT_EQ(input.angles, angles);
    EXPECT_EQ(Names(input), List{name});
    for (std::size_t i = 0; i < angles.size(); ++i) EXPECT_EQ(ValueOf(input, 0, i), float(100 + angles[i]));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  };
  for (const int angle : {0, 60, 120}) Grey8(fmt::format("I-{:03}/a.png", angle), 8, 6, 100 + angle);
  check({}, {0, 60, 120}, "a");
  for (const int angle : {10, 40, 100}) Grey8(fmt::format("{}/a.png", angle), 8, 6, 100 + angle);
  check({.angles = "10,40,100"}, {10, 40, 100}, "a");
  for (const int angle : {0, 60, 120}) Grey8(fmt::format("cup_{}.png", angle), 8, 6, 100 + angle);
  check({.angles = "120, 60, 0"}, {0, 60, 120}, "cup");
  for (const int angle : {0, 60, 120}) Grey8(fmt::format("cup-{:03}deg.png", angle), 8, 6, 100 + angle);
  check({.angles = "0 60 120"}, {0, 60, 120}, "cup");
  for (const int angle : {0, 45, 90, 135}) Grey8(fmt::format("cup_{}.png", angle), 8, 6, 100 + angle);
  check({}, {0, 45, 90, 135}, "cup");

  for (const int angle : {0, 60}) Grey8(fmt::format("{}/a.png", angle));
  EXPECT_SAYS(Complaint({.angles = "0,60,120"}), "the folder of the angle 120 is missing");
  EXPECT_SAYS(Complaint({.angles = "0,60"}), "three different");
  EXPECT_SAYS(Complaint({.angles = "0,90,180"}), "three different");
  EXPECT_SAYS(Complaint({.angles = "0,sixty,120"}), "no list of angles");
}

TEST_F(InputFormsTest, FoldersWhoseNamesLookLikeAnglesAreAskedForWithThoseAngles) {
  for (const int angle : {10, 40, 100}) Grey8(fmt::format("{}/a.png", angle));
  EXPECT_SAYS(Complaint(), "--angles 10,40,100");
  for (const int angle : {10, 40, 100}) Colour(fmt::format("{}/a.png", angle));
  EXPECT_SAYS(Joined(Open().warnings), "--angles 10,40,100");
  EXPECT_EQ(Open({.kind = "photos"}).warnings.size(), 0U);
  Colour("40/b.png");
  EXPECT_EQ(Joined(Open().warnings).find("--angles"), std::string::npos) << "not the same pictures";

  fs::remove_all(folder_);
  for (const int angle : {0, 45, 90}) Grey8(fmt::format("{}/a.png", angle));
  EXPECT_SAYS(Complaint(), "--angles 0,45,90");
}

TEST_F(InputFormsTest, StokesAsSumsThatHoldNoSigns) {
  const auto radiance = [](unsigned char mantissa) {  // red, green, blue = mantissa / 256
    std::string pixels;
    for (int i = 0; i < 6 * 5; ++i) pixels += std::string(3, char(mantissa)) + char(128);
    return "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 5 +X 6\n" + pixels;
  };
  File("01_s0.hdr", radiance(200));
  File("01_s0p1.hdr", radiance(150));
  File("01_s0p2.hdr", radiance(220));
  const Input input = Open();
  EXPECT_EQ(input.kind, InputKind::kStokes);
  EXPECT_EQ(Names(input), List{"01"});
  EXPECT_NEAR(ValueOf(input, 0, 1), -50 / 256.0, 0.003);
  EXPECT_NEAR(ValueOf(input, 0, 2), 20 / 256.0, 0.003);
}

TEST_F(InputFormsTest, StokesAsNumpyArrays) {
  const std::vector<std::uint16_t> halves(48, 0xB800);  // -0.5
  File("s0/a.npy", Npy("<f4", "(6, 8)", std::vector<float>(48, 2)));
  File("s1/a.npy", Npy("<f2", "(6, 8)", halves));
  File("s2/a.npy", Npy("<f8", "(6, 8, 1)", std::vector<double>(48, 0.25)));
  const Input input = Open();
  EXPECT_EQ(input.kind, InputKind::kStokes);
  EXPECT_EQ(ValueOf(input, 0, 0), 2);
  EXPECT_EQ(ValueOf(input, 0, 1), -0.5f);
  EXPECT_EQ(ValueOf(input, 0, 2), 0.25f);
  File("s2/a.npy", Npy("<f8", "(6, 8, 1)", std::vector<double>(40, 0.25)));
  EXPECT_SAYS(Complaint(), "cut off");
  File("s2/a.npy", Npy("<i8", "(6, 8)", std::vector<double>(48, 0.25)));
  EXPECT_SAYS(Complaint(), "<i8");
  File("s2/a.npy", Npy("<f8", "(6, 8, 2, 4)", std::vector<double>(400, 0.25)));
  EXPECT_SAYS(Complaint(), "(6, 8, 2, 4)");
  File("s2/a.npy", Npy("|u1", "(6, 8)", std::vector<std::uint8_t>(48, 9)));
  EXPECT_SAYS(Complaint(), "S1 and S2 have signs");
}

TEST_F(InputFormsTest, NumpyArraysByColumnsAreTurned) {
  const std::string head = "{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3, 3), }";
  std::string bytes = "\x93NUMPY\x01" + std::string(1, '\0') + std::string{char(head.size()), 0} + head;
  for (int c = 0; c < 3; ++c)
    for (int x = 0; x < 3; ++x)
      for (int y = 0; y < 2; ++y) {
        const float value = float(100 * c + 10 * y + x);
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
      }
  WriteFileAtomically(folder_ / "a.npy", bytes);
  const Picture picture = ReadPicture(folder_ / "a.npy");
  ASSERT_EQ(picture.planes.size(), 3u);
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y < 2; ++y)
      for (int x = 0; x < 3; ++x)
        EXPECT_EQ(picture.planes[std::size_t(c)](x, y), float(100 * c + 10 * y + x));
}

TEST_F(InputFormsTest, CountsAsNumpyArraysAreCounts) {
  for (const int angle : {0, 45, 90, 135})
    File(fmt::format("I-{}/a.npy", angle),
         Npy("<u2", "(6, 8)", std::vector<std::uint16_t>(48, std::uint16_t(3000 + angle))));
  const Input input = Open({.bits = 12});
  EXPECT_EQ(input.sensor.bits, 12);
  EXPECT_EQ(ValueOf(input, 0, 1), 3045);
  EXPECT_EQ(ReadView(input, 0).pictures[0].bits, 16);
}

TEST_F(InputFormsTest, StokesPicturesAsTheColoursOfAPhotoAreRefusedAndSlightRingingIsNot) {
  std::vector<float> samples(40 * 30 * 3, 0.5f);
  samples[1] = -1e-3f;
  File("a.npy", Npy("<f4", "(30, 40, 3)", samples));
  EXPECT_EQ(Open().kind, InputKind::kPhotos);
  for (std::size_t i = 1; i < samples.size(); i += 12) samples[i] = -0.1f;  // S1 of a fourth of the pixels
  File("b.npy", Npy("<f4", "(30, 40, 3)", samples));
  EXPECT_SAYS(Complaint(), "25 % of the samples in channel 2 are below 0");
  EXPECT_SAYS(Complaint(), "b.npy");
  EXPECT_SAYS(Complaint(), "NAME_s0.npy NAME_s1.npy NAME_s2.npy");
  File("a.npy", Npy("<f4", "(3, 30, 40)", samples));
  EXPECT_SAYS(Complaint(), "NAME_s0.npy NAME_s1.npy NAME_s2.npy");
}

}  // namespace
}  // namespace polarscan
