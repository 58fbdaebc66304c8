// SPDX-License-Identifier: Apache-2.0
// What `polarscan demosaic` does not write over, and what it and `polarscan check` say of doubtful pictures.
#include <gtest/gtest.h>

#include <cmath>

#include "core/files/files.h"
#include "demosaic_command.h"

namespace polarscan::test {
namespace {

namespace fs = std::filesystem;

TEST_F(DemosaicCommand, OverwritesNeitherItsInputNorAnyFilesButItsOwn) {
  WriteAngles("a", 0.8, 0.3, -0.1);
  WritePng(folder_ / "photos/a.png", Image<Rgb8>(40, 30, {1, 2, 3}));
  WritePng(folder_ / "notes/a.png", Image<Rgb8>(40, 30, {4, 5, 6}));
  ASSERT_EQ(Run().exit_code, 0);
  const auto before = Contents(folder_.path());
  const std::string photos = (folder_ / "photos").string(), angles = Input().string(),
                    views = Views().string();
  for (const auto& [input, output] : std::vector<std::pair<std::string, std::string>>{
           {photos, photos},                   // its input
           {angles, angles + "/I-45"},         // inside of it
           {photos, folder_.path().string()},  // above it
           {angles, angles},
           {views, views},
           {angles, (folder_ / "notes").string()}}) {  // a file of the same name
    const Outcome outcome = RunPolarscan({"demosaic", input, "-o", output, "--bits", "16"});
    EXPECT_EQ(outcome.exit_code, kFailed) << output;
    EXPECT_NE(outcome.err.find(output), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("-o"), std::string::npos) << outcome.err;
    EXPECT_TRUE(Contents(folder_.path()) == before) << output;
  }
  WriteAngles("b", 0.8, 0.3, -0.1);
  WriteFileAtomically(Views() / "b.png", "mine, among the views");
  EXPECT_EQ(Run().exit_code, kFailed);
  EXPECT_EQ(ReadFile(Views() / "b.png"), "mine, among the views");
}

TEST_F(DemosaicCommand, AScanIsNoFolderOfPicturesAndItsInputIsNamed) {
  WriteAngles("a", 0.8, 0.3, 0);
  WriteJson(Input() / "scan.json", {{"input", "/data/cup"}, {"stages", nlohmann::json::object()}});
  const Outcome outcome = Run();
  EXPECT_EQ(outcome.exit_code, kFailed);
  EXPECT_NE(outcome.err.find("this is a scan of /data/cup"), std::string::npos) << outcome.err;
}

TEST_F(DemosaicCommand, AColourMapOfAnglesIsNoPictureOfAngles) {
  WritePng(Input() / "rgb/a.png", Image<Rgb8>(40, 30, {90, 90, 90}));
  WritePng(Input() / "aop/a.png", Image<Rgb8>(40, 30, {255, 0, 90}));
  WritePng(Input() / "dop/a.png", Image<std::uint8_t>(40, 30, 90));
  const Outcome outcome = Run({});
  EXPECT_EQ(outcome.exit_code, kFailed);
  EXPECT_NE(outcome.err.find("the picture in aop/ has colours"), std::string::npos) << outcome.err;
}

TEST_F(DemosaicCommand, NoCommandWritesIntoAFolderOfOtherFiles) {
  const std::string mosaics = (folder_ / "mosaics").string(), foreign = (folder_ / "foreign").string();
  for (const char* name : {"a.png", "b.png"})
    WritePng(folder_ / "mosaics/mosaic" / name, Image<std::uint8_t>(40, 32, 9));
  WriteFileAtomically(folder_ / "mosaics/set.json", R"({"sensor": {"layout": "90 45 / 135 0"}})");
  WriteFileAtomically(folder_ / "foreign/thesis.txt", "irreplaceable");
  WriteFileAtomically(folder_ / "foreign/set.json", R"({"renderer": "another"})");
  const auto before = Contents(folder_.path());
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"simulate", "--width", "32", "--height", "32", "--rings", "30:1"},
           {"capture", "--camera", "simulated", "--frames", "1", "--set", "width=32", "--set", "height=32"},
           {"import", mosaics},
           {"demosaic", mosaics},
           {"calibrate", "dark", mosaics},
           {"reconstruct", mosaics}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {"-o", foreign});
    const Outcome outcome = RunPolarscan(arguments);
    EXPECT_EQ(outcome.exit_code, kFailed) << command[0] << outcome.err;
    EXPECT_NE(outcome.err.find(foreign), std::string::npos) << outcome.err;
    EXPECT_TRUE(Contents(folder_.path()) == before) << command[0];
  }
}

TEST_F(DemosaicCommand, ViewsWithLessThanNoLightAreNamed) {
  WriteAngles("a", 0.8, 0.3, -0.1);
  WriteAngles("b", 0.02, 0, 0);
  const Outcome outcome = Run({"--bits", "16", "--black-level", "5000"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("(S0 below 0 or no number): b. Is --black-level right,"), std::string::npos)
      << outcome.err;
}

TEST_F(DemosaicCommand, ViewsWithoutANumberInThemAreNamed) {
  const Image<float> whole(40, 30, 0.5f), none(40, 30, std::nanf(""));
  WriteFloatTiff(Input() / "a.tif", {&whole, &whole, &whole});
  WriteFloatTiff(Input() / "b.tif", {&none, &none, &none});
  const Outcome outcome = Run({"--input-kind", "stokes"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("(S0 below 0 or no number): b."), std::string::npos) << outcome.err;
}

TEST_F(DemosaicCommand, WhatNoLightCanBeIsNamed) {
  WriteAngles("a", 0.8, 0.3, -0.1);
  WriteAngles("b", 0.8, 0.3, -0.1);
  for (const char* angle : {"I-0", "I-90"})  // another exposure than the other two
    WritePng(Input() / angle / "b.png", Image<std::uint16_t>(40, 30, 8000));
  const auto says = [&](const Outcome& outcome, const std::string& words) {
    EXPECT_NE(outcome.err.find(words), std::string::npos) << words << "\n" << outcome.err;
  };
  const std::string words = "1 view has pictures behind the four angles that do not belong together";
  says(Run(), words);
  says(RunPolarscan({"check", Input().string(), "--bits", "16"}), words);
  fs::remove_all(Input());
  const Image<float> s0(40, 30, 0.2f), s1(40, 30, 0.5f);
  WriteFloatTiff(Input() / "a.tif", {&s0, &s1, &s1});
  fs::remove_all(Views());
  says(Run({"--input-kind", "stokes"}), "1 view has more polarized light than light");
}

TEST_F(DemosaicCommand, TheSamePictureTwiceIsNamed) {
  for (const char* view : {"a", "b"}) WriteAngles(view, 0.8, 0.3, -0.1);
  WriteAngles("c", 0.8, 0.2, -0.1);
  const Outcome outcome = Run();
  EXPECT_NE(outcome.err.find("a, b hold the same picture"), std::string::npos) << outcome.err;
}

TEST_F(DemosaicCommand, ViewsOfOtherPicturesAreNotWrittenOver) {
  WriteAngles("a", 0.8, 0.3, -0.1);
  ASSERT_EQ(Run().exit_code, kDone);
  const fs::path moved = folder_ / "moved";
  fs::copy(Input(), moved, fs::copy_options::recursive);
  const auto again = [&] {
    return RunPolarscan({"demosaic", moved.string(), "-o", Views().string(), "--bits", "16"});
  };
  const Outcome other = again();
  EXPECT_EQ(other.exit_code, kFailed);
  EXPECT_NE(other.err.find("this folder holds the views of other pictures"), std::string::npos) << other.err;
  fs::remove_all(Input());
  EXPECT_EQ(again().exit_code, kDone) << "they were moved";
}

TEST_F(DemosaicCommand, TwoAtOnceInOneFolderAreNotLetIn) {
  WriteAngles("a", 0.8, 0.3, -0.1);
  CreateFolder(Views());
  {
    const Descriptor other = LockFolder(Views(), "folder of views");
    const Outcome outcome = Run();
    EXPECT_EQ(outcome.exit_code, kFailed);
    EXPECT_NE(outcome.err.find("another polarscan is working on this folder of views"), std::string::npos)
        << outcome.err;
  }
  EXPECT_EQ(Run().exit_code, kDone);
}

TEST_F(DemosaicCommand, EmptyMasksStopItBeforeAnyWork) {
  WriteAngles("a", 0.8, 0.3, -0.1);
  WritePng(Input() / "masks/a.png", Image<std::uint8_t>(40, 30, 0));
  const Outcome outcome = Run();
  EXPECT_EQ(outcome.exit_code, kFailed);
  EXPECT_NE(outcome.err.find("all 1 masks are empty"), std::string::npos) << outcome.err;
  EXPECT_FALSE(fs::exists(Views() / "a.tif"));
}

TEST_F(DemosaicCommand, CheckSaysWhatAFolderOfPicturesIs) {
  WriteAngles("a", 0.8, 0.3, -0.1);
  WriteAngles("b", 0.8, 0.3, -0.1);
  WritePng(Input() / "masks/a.png", Image<std::uint8_t>(40, 30, 255));
  const auto check = [&] { return RunPolarscan({"check", Input().string()}); };
  const Outcome sound = check();
  EXPECT_EQ(sound.exit_code, kDone) << sound.err;
  for (const char* words : {"input: 2 views of 40x30, angles", "masks for 1, poses for 0: sound", "are full",
                            "a, b hold the same picture"})
    EXPECT_NE(sound.err.find(words), std::string::npos) << words << sound.err;
  WriteFileAtomically(Input() / "sparse/cameras.txt", "1 OPENCV_FISHEYE 40 30 50 50 20 15 0 0 0 0\n");
  WriteFileAtomically(Input() / "sparse/images.txt",
                      "1 1 0 0 0 0 0 3 1 a.png\n\n2 1 0 0 0 1 0 3 1 b.png\n\n");
  WriteFileAtomically(Input() / "sparse/points3D.txt", "");
  const Outcome fisheye = check();
  EXPECT_EQ(fisheye.exit_code, kDataLost) << "as reconstruct would refuse it";
  EXPECT_NE(fisheye.err.find("OPENCV_FISHEYE"), std::string::npos) << fisheye.err;
  WriteFileAtomically(Input() / "sparse/cameras.txt", "1 PINHOLE 40 30 50 50 20 15\n");
  WriteFileAtomically(Input() / "sparse/images.txt",
                      "1 1 0 0 0 0 0 3 1 C:\\pictures\\a.png\n\n2 1 0 0 0 1 0 3 1 left/b.tif\n\n");
  const Outcome elsewhere = check();
  EXPECT_NE(elsewhere.err.find("poses for 2"), std::string::npos) << elsewhere.err << "as reconstruct counts";
  fs::remove_all(Input() / "sparse");
  fs::resize_file(Input() / "I-90/b.png", 60);
  const Outcome damaged = check();
  EXPECT_EQ(damaged.exit_code, kDataLost);
  EXPECT_NE(damaged.err.find("I-90/b.png"), std::string::npos) << damaged.err;
}

TEST_F(DemosaicCommand, CheckAndADryRunNameAllThatReconstructWouldNeed) {
  const auto says = [](const Outcome& outcome, const char* words) {
    EXPECT_NE(outcome.err.find(words), std::string::npos) << words << "\n" << outcome.err;
  };
  const auto plan = [&] {
    return RunPolarscan({"reconstruct", Input().string(), "-o", (folder_ / "scan").string(), "--dry-run"});
  };
  for (const char* name : {"a", "b"})
    WritePng(Input() / "mosaic" / (std::string(name) + ".png"), Image<std::uint16_t>(40, 30, 300));
  const Outcome unknown = RunPolarscan({"check", Input().string()});
  for (const char* words : {"--layout", "--bits 12", "not enough for reconstruct"}) says(unknown, words);

  fs::remove_all(Input());
  WriteAngles("a", 0.8, 0.3, -0.1);
  says(RunPolarscan({"check", Input().string()}), "only one view");
  EXPECT_EQ(plan().exit_code, kFailed);
  WriteAngles("b", 0.8, 0.3, -0.1);
  EXPECT_EQ(plan().exit_code, kDone);
  for (const char* name : {"masks/a.png", "masks/b.png"})
    WritePng(Input() / name, Image<std::uint8_t>(40, 30, 0));
  const Outcome empty = plan();
  EXPECT_EQ(empty.exit_code, kFailed);
  says(empty, "all 2 masks are empty");
}

}  // namespace
}  // namespace polarscan::test
