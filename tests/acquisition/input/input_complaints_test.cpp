// SPDX-License-Identifier: Apache-2.0
// What is wrong with a folder of pictures is named, with the option that decides where it could mean two
// things.
#include <fmt/format.h>

#include "input/input_folder.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

TEST_F(InputTest, AMissingFolderIsNamed) {
  EXPECT_SAYS(Complaint(), "no pictures");
  fs::remove_all(folder_);
  EXPECT_SAYS(Complaint(), "there is no such folder");
  EXPECT_SAYS(Complaint(), folder_.string());
  WriteFileAtomically(folder_, "a file");
  EXPECT_SAYS(Complaint(), "this is a file");
}

TEST_F(InputTest, AnEmptyFolderSaysWhatIsWanted) {
  EXPECT_SAYS(Complaint(), "there are no pictures here");
  fs::create_directories(folder_ / "mosaic");
  EXPECT_SAYS(Complaint({.layout = "90 45 / 135 0"}), "no mosaic pictures");
}

TEST_F(InputTest, AngleFoldersWithDifferentViewsNameTheMissingOnes) {
  Angles({"000", "001", "002"});
  fs::remove(folder_ / "I-45/001.png");
  fs::remove(folder_ / "I-135/002.png");
  const std::string complaint = Complaint();
  EXPECT_SAYS(complaint, "I-45/ lacks 001");
  EXPECT_SAYS(complaint, "I-135/ lacks 002");
  fs::remove_all(folder_ / "I-90");
  EXPECT_SAYS(Complaint(), "the folder of the angle 90 is missing");
}

TEST_F(InputTest, PicturesOfOneViewThatDifferInSizeAreNamed) {
  Angles({"000", "001"});
  Grey8("I-90/001.png", 9, 6);
  const std::string complaint = Complaint();
  EXPECT_SAYS(complaint, "8x6 and 9x6");
  EXPECT_SAYS(complaint, "I-90/001.png");
  Colour("I-90/001.png");
  EXPECT_SAYS(Complaint(), "differ in colour");
}

TEST_F(InputTest, AWrongLayoutIsNamed) {
  Grey8("mosaic/a.png");
  EXPECT_SAYS(Complaint({.layout = "90 45 / 135 30"}), "\"90 45 / 135 30\"");
  EXPECT_SAYS(Complaint({.layout = "sony"}), "not a mosaic layout");
  EXPECT_EQ(Complaint({.layout = "90 45 / 135 0"}), "");
}

TEST_F(InputTest, WhatIsAmbiguousAsksForTheOptionThatDecides) {
  Grey8("a.png");
  EXPECT_SAYS(Complaint(), "--input-kind");
  EXPECT_EQ(Complaint({.kind = "photos"}), "");
  EXPECT_SAYS(Complaint({.kind = "mosaic"}), "--layout");
  EXPECT_EQ(Complaint({.kind = "mosaic", .layout = "90 45 / 135 0"}), "");
  EXPECT_EQ(Open({.layout = "90 45 / 135 0"}).kind, InputKind::kMosaic);  // only mosaics have a layout
}

TEST_F(InputTest, SixteenBitMosaicsAskForTheirDepth) {
  Grey16("mosaic/a.png", 60000);
  EXPECT_SAYS(Complaint({.layout = "90 45 / 135 0"}), "--bits");
  EXPECT_SAYS(Complaint({.layout = "90 45 / 135 0", .bits = 12}), "60000 does not fit in 12 bits");
  EXPECT_EQ(Complaint({.layout = "90 45 / 135 0", .bits = 16}), "");
}

TEST_F(InputTest, SixteenBitAnglePicturesAreAskedForTheirDepthUnlessTheyShowIt) {
  for (const char* angle : {"0", "45", "90", "135"}) Grey16(std::string(angle) + "/a.png", 4000);
  EXPECT_SAYS(Complaint(), "--bits");
  Grey16("90/a.png", 40000);
  const Input input = Open();
  EXPECT_EQ(input.sensor.white_dn, 65535);
  EXPECT_SAYS(input.notes.at(0), "--bits");
}

TEST_F(InputTest, SeveralKindsInOneFolderAskWhichToUse) {
  Angles({"000"});
  Floats("stokes/a.tif", 4);
  EXPECT_SAYS(Complaint(), "--input-kind angles");
  EXPECT_EQ(Complaint({.kind = "stokes"}), "");
}

TEST_F(InputTest, AMosaicOfHalfCellsAndAFolderGivenTwiceAreNamed) {
  Grey8("mosaic/a.png", 9, 6);
  InputOptions options;
  options.layout = "90 45 / 135 0";
  EXPECT_SAYS(Complaint(options), "9x6 pixels does not consist of whole 2x2 cells");
  Grey8("mosaic/a.png");
  Progress progress;
  try {
    OpenInputs({folder_, folder_ / "mosaic" / ".."}, options, progress);
    FAIL() << "no error was thrown";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("given twice"), std::string::npos) << error.what();
  }
}

TEST_F(InputTest, AMaskOfAnotherSizeIsNamed) {
  Angles({"000"});
  Grey8("masks/000.png", 8, 7);
  EXPECT_SAYS(Complaint(), "the mask is 8x7, its picture 8x6");
  EXPECT_SAYS(Complaint(), "masks/000.png");
}

TEST_F(InputTest, MasksThatMatchNoViewAreAnError) {
  Angles({"000"});
  Grey8("masks/view000.png");
  EXPECT_SAYS(Complaint(), "no mask has the name of a view");
  EXPECT_SAYS(Complaint(), "000.png, not view000.png");
}

TEST_F(InputTest, ABadSetJsonIsNamed) {
  Grey8("mosaic/a.png");
  Set("{");
  EXPECT_SAYS(Complaint(), "set.json");
  EXPECT_SAYS(Complaint(), "it ends too early: it was cut off");
  Set(" ");
  EXPECT_SAYS(Complaint(), "it is empty");
  Set("{\n  \"sensor\": nothing\n}");
  EXPECT_SAYS(Complaint(), "line 2, column 14: what stands there (othing) does not belong there");
  Set(R"({"sensor": {"bits": "twelve"}})");
  EXPECT_SAYS(Complaint(), "\"bits\" must be a number");
  for (const char* bits : {"1e24", "0", "11.5"}) {
    Set(fmt::format(R"({{"sensor": {{"bits": {}}}}})", bits));
    EXPECT_SAYS(Complaint(), "\"bits\" must be a whole number from 1 to 32");
  }
  for (const char* absurd : {"gamma\": 1e-9", "gamma\": -1", "white_dn\": -4", "dn_per_e\": 1e300",
                             "black_dn\": -1", "read_noise_e\": -2"}) {
    Set(fmt::format(R"({{"sensor": {{"layout": "90 45 / 135 0", "{}}}}})", absurd));
    EXPECT_SAYS(Complaint(), "must be a number from");
  }
  Set(R"({"input_kind": "video"})");
  EXPECT_SAYS(Complaint(), "input-kind video");
  Set(R"({"sensor": {"layout": "90 45 / 135 0", "black_dn": 300}})");
  EXPECT_SAYS(Complaint(), "black level 300 is not below");
}

TEST_F(InputTest, AFourthPageWithValuesBelow0IsNoNoise) {
  const Image<float> page(8, 6, 0.5f), circular(8, 6, -0.01f);
  WriteFloatTiff(folder_ / "a.tif", {&page, &page, &page, &circular});
  EXPECT_SAYS(Complaint(), "the fourth page is the noise");
}

TEST_F(InputTest, StokesPicturesMustBeFloatingPoint) {
  for (const char* name : {"v_s0.png", "v_s1.png", "v_s2.png"}) Grey16(name, 5);
  EXPECT_SAYS(Complaint(), "floating point");
  fs::remove(folder_ / "v_s1.png");
  EXPECT_SAYS(Complaint(), "*_s1 lacks v");
}

TEST_F(InputTest, TwoFilesForOneViewAreAnError) {
  Colour("a.png");
  fs::copy_file(folder_ / "a.png", folder_ / "a.tiff");
  EXPECT_SAYS(Complaint(), "two pictures have the same name");
}

TEST_F(InputTest, AMosaicCannotBeDeclaredClockwise) {
  Grey8("mosaic/a.png");
  EXPECT_SAYS(Complaint({.layout = "90 45 / 135 0", .aop_sense = "clockwise"}), "Swap 45 and 135");
}

}  // namespace
}  // namespace polarscan
