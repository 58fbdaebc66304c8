// SPDX-License-Identifier: Apache-2.0
// Which pictures of which folders are one set, what of them is left out, and how that is said.
#include <fmt/format.h>

#include "input/input_forms.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

TEST_F(InputFormsTest, PicturesInFoldersAreOneSet) {
  Colour("images/cam1/0.png");
  Colour("images/cam2/0.png");
  Colour("images/1.png");
  Grey8("masks/cam2/0.png", 8, 6, 255);
  const Input input = Open();
  EXPECT_EQ(Names(input), (List{"1", "cam1-0", "cam2-0"}));
  EXPECT_TRUE(input.views[2].mask);
  EXPECT_FALSE(input.views[1].mask);
  Colour("images/cam2-0.png");
  EXPECT_SAYS(Complaint(), "two pictures have the same name");
}

TEST_F(InputFormsTest, FoldersOfSeveralInputsAreNotMixedUpAsPhotos) {
  for (const char* day : {"day1", "day2"})
    for (const char* angle : {"I-00", "I-45", "I-90", "I-135"}) Grey8(fmt::format("{}/{}/a.png", day, angle));
  EXPECT_SAYS(Complaint(), "there are no pictures here");
  EXPECT_SAYS(Complaint(), "day1/I-00/");
}

TEST_F(InputFormsTest, WhatIsNotTakenIsNamedOnceAKind) {
  Grey8("mosaic/a.png");
  Grey8("mosaic/b.png");
  for (int i = 0; i < 5; ++i) File(fmt::format("mosaic/{}.raw", i), "counts");
  File("IMG_1.HEIC", "ftypheic");
  Grey8("rejected/c.png");
  for (const char* name :
       {"README.md", "notes.txt", "Thumbs.db", ".DS_Store", "preview.png", "truth/depth.png", "masks/a.png"})
    File(name, "");
  Grey8("masks/a.png", 8, 6, 255);
  fs::create_directories(folder_ / "sparse");
  const std::vector<std::string> warnings = OpenMosaics().warnings;
  ASSERT_EQ(warnings.size(), 3u) << Joined(warnings);
  EXPECT_SAYS(Joined(warnings),
              "5 .raw files are not read (mosaic/0.raw, mosaic/1.raw, mosaic/2.raw and 2 more)");
  EXPECT_SAYS(Joined(warnings), "1 .HEIC file is not read (IMG_1.HEIC): convert");
  EXPECT_SAYS(Joined(warnings), "1 picture in rejected/ is not used (c.png)");
}

TEST_F(InputFormsTest, LinksThatLeadInCirclesAndNowhereMakeNoMorePictures) {
  for (const char* name : {"mosaic/a.png", "mosaic/b.png"}) Grey8(name);
  Set(R"({"sensor": {"layout": "90 45 / 135 0"}})");
  fs::create_directory_symlink(".", folder_ / "mosaic/again");
  fs::create_directory_symlink("..", folder_ / "mosaic/up");
  fs::create_symlink("nowhere.png", folder_ / "mosaic/c.png");
  const Input input = Open();
  EXPECT_EQ(input.views.size(), 2u);
  EXPECT_SAYS(Joined(input.warnings), "1 link leads to a file that is not there (mosaic/c.png)");
}

TEST_F(InputFormsTest, WhereNothingIsTakenTheErrorSaysWhatLiesThere) {
  for (int i = 0; i < 4; ++i) File(fmt::format("photos/{}.HEIC", i), "ftypheic");
  EXPECT_SAYS(Complaint(), "4 .HEIC files are not read");
  EXPECT_SAYS(Complaint(), "JPEG");
  fs::rename(folder_ / "photos", folder_ / "mosaic");
  EXPECT_SAYS(Complaint({.layout = kSony}), "4 .HEIC files are not read");
}

TEST_F(InputFormsTest, PicturesOfOneSetThatAreUnlikeAreNamed) {
  for (const char* name : {"a", "b", "c"})
    WritePng(folder_ / "mosaic" / (std::string(name) + ".png"), Image<std::uint16_t>(8, 6, 300));
  Grey8("mosaic/d.png");
  EXPECT_SAYS(Complaint({.layout = kSony, .bits = 12}),
              "3 of them have 16 bits, 1 has 8 bits (mosaic/d.png)");
  WritePng(folder_ / "mosaic/d.png", Image<std::uint16_t>(6, 8, 300));
  EXPECT_SAYS(Complaint({.layout = kSony, .bits = 12}), "were turned");
  EXPECT_SAYS(Complaint({.layout = kSony, .bits = 12}), "1 has 6x8 pixels (mosaic/d.png)");
  WritePng(folder_ / "mosaic/d.png", Image<std::uint16_t>(8, 4, 300));
  const Input input = OpenInput(folder_, {.layout = kSony, .bits = 12});
  EXPECT_SAYS(Joined(input.warnings), "1 has 8x4 pixels (mosaic/d.png)");

  fs::remove_all(folder_ / "mosaic");
  Colour("photos/a.png");
  Colour("photos/b.png");
  Grey8("photos/c.png");
  EXPECT_SAYS(Joined(Open().warnings), "2 of them have colours, 1 has grey values (photos/c.png)");
}

TEST_F(InputFormsTest, SeveralFoldersAreOneSetAndEachMeansWhatItSays) {
  Grey8("monday/mosaic/a.png", 8, 6, 10);
  Grey8("tuesday/mosaic/a.png", 8, 6, 20);
  Grey8("tuesday/mosaic/b.png", 8, 6, 30);
  File("monday/set.json", R"({"sensor": {"layout": "90 45 / 135 0", "black_dn": 5}})");
  File("tuesday/set.json", R"({"sensor": {"layout": "0 45 / 135 90"}})");
  fs::create_directories(folder_ / "monday/sparse");
  Progress silent;
  const Input input = OpenInputs({folder_ / "monday", folder_ / "tuesday"}, {}, silent);
  EXPECT_EQ(Names(input), (List{"monday-a", "tuesday-a", "tuesday-b"}));
  EXPECT_EQ(ValueOf(input, 1), 20);
  EXPECT_EQ(ReadView(input, 2).name, "tuesday-b");
  EXPECT_EQ(input.Source(0).first->sensor.black_dn, 5);
  EXPECT_EQ(input.Source(2).first->sensor.layout, ParseLayout("0 45 / 135 90"));
  EXPECT_EQ(input.Source(2).second, 1);
  EXPECT_FALSE(input.known_model);
  EXPECT_SAYS(Joined(input.warnings), "known poses");
  EXPECT_NE(Meaning(input), Meaning(OpenInputs({folder_ / "tuesday", folder_ / "monday"}, {}, silent)));

  Colour("photos/c.png");
  EXPECT_THROW(OpenInputs({folder_ / "monday", folder_ / "photos"}, {}, silent), Error);
}

}  // namespace
}  // namespace polarscan
