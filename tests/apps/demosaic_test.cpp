// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "core/files.h"
#include "core/image_io.h"
#include "demosaic/stokes.h"
#include "program.h"

namespace polarscan::test {
namespace {

namespace fs = std::filesystem;

class DemosaicCommand : public testing::Test {
 protected:
  fs::path Input() const { return folder_ / "input"; }
  fs::path Views() const { return folder_ / "views"; }

  // Four angle folders; the light of the view behind a polarizer is (s0 + s1 cos 2a + s2 sin 2a) / 2 of full
  // scale.
  void WriteAngles(const std::string& view, double s0, double s1, double s2) const {
    for (const int angle : {0, 45, 90, 135}) {
      const double turn = 2 * angle * std::numbers::pi / 180;
      const double light = (s0 + s1 * std::cos(turn) + s2 * std::sin(turn)) / 2;
      WritePng(Input() / ("I-" + std::to_string(angle)) / (view + ".png"),
               Image<std::uint16_t>(40, 30, std::uint16_t(std::lround(65535 * light))));
    }
  }
  Outcome Run(std::vector<std::string> options = {"--bits", "16"}) const {
    std::vector<std::string> arguments = {"demosaic", Input().string(), "-o", Views().string()};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return RunPolarscan(arguments);
  }
  fs::file_time_type Age(const std::string& name) const { return fs::last_write_time(Views() / name); }

  TemporaryFolder folder_;
};

TEST_F(DemosaicCommand, WritesStokesPicturesMasksAndWhatIsDone) {
  WriteAngles("a", 0.8, 0.3, -0.1);
  WriteAngles("b", 0.4, 0, 0);
  WritePng(Input() / "masks/a.png", Image<std::uint8_t>(40, 30, 255));
  const Outcome outcome = Run();
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const StokesImage a = ReadStokes(Views() / "a.tif");
  EXPECT_NEAR(a.s0(20, 15), 0.8, 1e-4);
  EXPECT_NEAR(a.s1(20, 15), 0.3, 1e-4);
  EXPECT_NEAR(a.s2(20, 15), -0.1, 1e-4);
  EXPECT_EQ(ReadMask(Views() / "masks/a.png")(3, 3), 255);
  EXPECT_FALSE(fs::exists(Views() / "masks/b.png"));
  // One scale for the set: b has half the light, so its picture is darker by the factor 2^(1/2.2).
  const float bright = ReadPicture(Views() / "a.png").planes[0](5, 5),
              dark = ReadPicture(Views() / "b.png").planes[0](5, 5);
  EXPECT_EQ(bright, 255);
  EXPECT_NEAR(bright / dark, std::pow(2, 1 / 2.2), 0.01);
  const nlohmann::json done = ReadJson(Views() / "views.json");
  EXPECT_EQ(done["polarized"], true);
  EXPECT_EQ(done["views"].size(), 2u);
}

TEST_F(DemosaicCommand, WritesPicturesForPeopleOnlyWhenAskedTo) {
  WriteAngles("a", 0.8, 0.3, 0);
  ASSERT_EQ(Run().exit_code, 0);
  EXPECT_FALSE(fs::exists(Views() / "pictures"));
  ASSERT_EQ(Run({"--bits", "16", "--pictures"}).exit_code, 0);
  for (const char* name : {"s0", "diffuse", "specular", "dop", "aop", "aop_dop", "aop_even", "redundancy"})
    EXPECT_EQ(ReadPicture(Views() / "pictures/a" / (std::string(name) + ".png")).width(), 40) << name;
  const Picture aop = ReadPicture(Views() / "pictures/a/aop.png");  // 0 degrees: red
  EXPECT_GT(aop.planes[0](3, 3), 250);
  EXPECT_LT(aop.planes[1](3, 3), 10);
  fs::remove(Views() / "pictures/a/dop.png");
  ASSERT_EQ(Run({"--bits", "16", "--pictures"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(Views() / "pictures/a/dop.png"));
}

TEST_F(DemosaicCommand, PicturesForPeopleStayAndFollowTheirViewsInLaterRuns) {
  WriteAngles("a", 0.8, 0.3, 0);
  ASSERT_EQ(Run({"--bits", "16", "--pictures"}).exit_code, 0);
  const auto before = Contents(Views() / "pictures/a");
  const auto age = Age("a.tif");
  ASSERT_EQ(Run().exit_code, 0);
  EXPECT_TRUE(Contents(Views() / "pictures/a") == before);
  EXPECT_EQ(Age("a.tif"), age);
  WriteAngles("a", 0.8, 0, 0.3);
  ASSERT_EQ(Run().exit_code, 0);
  EXPECT_FALSE(ReadFile(Views() / "pictures/a/aop.png") == before.at("aop.png"));
}

TEST_F(DemosaicCommand, RunAgainKeepsWhatIsValidAndMakesTheRest) {
  for (const char* view : {"a", "b", "c", "d"}) WriteAngles(view, 0.8, 0.3, -0.1);
  ASSERT_EQ(Run().exit_code, 0);
  const auto a = Age("a.tif"), b = Age("b.tif"), c = Age("c.tif");
  WriteAngles("b", 0.5, 0.2, -0.1);                                  // other input
  WriteFileAtomically(Views() / "c.tif", "damaged");                 // output is not what was written
  WriteFileAtomically(Views() / ".a.12-3.tmp.tif", "half-written");  // left by a killed run
  for (const int angle : {0, 45, 90, 135}) fs::remove(Input() / ("I-" + std::to_string(angle)) / "d.png");
  ASSERT_EQ(Run().exit_code, 0);
  EXPECT_EQ(Age("a.tif"), a);
  EXPECT_NE(Age("b.tif"), b);
  EXPECT_NE(Age("c.tif"), c);
  EXPECT_NEAR(ReadStokes(Views() / "c.tif").s0(3, 3), 0.8, 1e-4);
  for (const char* name : {"d.tif", "d.png", ".a.12-3.tmp.tif"})
    EXPECT_FALSE(fs::exists(Views() / name)) << name;
  ASSERT_EQ(Run({"--bits", "16", "--black-level", "100"}).exit_code, 0);
  EXPECT_NE(Age("a.tif"), a);
}

TEST_F(DemosaicCommand, GivesTheSameBytesForOneAndTwoThreads) {
  for (const char* view : {"a", "b", "c"}) WriteAngles(view, 0.8, 0.3, -0.1);
  ASSERT_EQ(Run({"--bits", "16", "--threads", "1"}).exit_code, 0);
  fs::rename(Views(), folder_ / "one");
  ASSERT_EQ(Run({"--bits", "16", "--threads", "2"}).exit_code, 0);
  for (const char* name : {"a.tif", "b.png", "c.tif", "views.json"})
    EXPECT_EQ(HashFile(folder_ / "one" / name), HashFile(Views() / name)) << name;
}

TEST_F(DemosaicCommand, ClockwiseSourcesAreTurnedAtTheDoor) {
  WriteAngles("a", 0.8, 0.3, -0.1);
  ASSERT_EQ(Run({"--bits", "16", "--aop-sense", "clockwise"}).exit_code, 0);
  EXPECT_NEAR(ReadStokes(Views() / "a.tif").s2(4, 4), 0.1, 1e-4);
}

// 16-bit aop/ of 45 degrees anticlockwise, half a turn being full scale.
TEST_F(DemosaicCommand, ReadsAnglesAndDegreesOfPolarization) {
  WritePng(Input() / "rgb/a.png", Image<Rgb8>(40, 30, {100, 100, 100}));
  WritePng(Input() / "aop/a.png", Image<std::uint16_t>(40, 30, 16384));
  WritePng(Input() / "dop/a.png", Image<std::uint16_t>(40, 30, 32768));
  const Outcome outcome = Run({});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const StokesImage a = ReadStokes(Views() / "a.tif");
  EXPECT_NEAR(a.s0(4, 4), 200 / 255.0, 1e-5);
  EXPECT_NEAR(a.s1(4, 4), 0, 1e-4);
  EXPECT_NEAR(a.s2(4, 4), 100 / 255.0, 1e-4);
  EXPECT_NE(outcome.err.find("--aop-sense"), std::string::npos) << outcome.err;
  ASSERT_EQ(Run({"--aop-sense", "clockwise"}).exit_code, 0);
  EXPECT_NEAR(ReadStokes(Views() / "a.tif").s2(4, 4), -100 / 255.0, 1e-4);
}

TEST_F(DemosaicCommand, PhotosComeOutAsTheyWentInAndWithoutPolarization) {
  Image<Rgb8> photo(256, 4);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 256; ++x) photo(x, y) = {std::uint8_t(x), std::uint8_t(255 - x), 40};
  WritePng(Input() / "a.png", photo);
  const Outcome outcome = Run({"--pictures"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("--pictures makes none"), std::string::npos) << outcome.err;
  EXPECT_FALSE(fs::exists(Views() / "pictures"));
  const Picture before = ReadPicture(Input() / "a.png"), after = ReadPicture(Views() / "a.png");
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_TRUE(std::ranges::equal(before.planes[c].pixels(), after.planes[c].pixels()));
  EXPECT_EQ(ReadJson(Views() / "views.json")["polarized"], false);
  const StokesImage view = ReadStokes(Views() / "a.tif");
  EXPECT_EQ(view.s1(100, 2), 0);
  EXPECT_EQ(view.s2(100, 2), 0);
}

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
  EXPECT_NE(outcome.err.find("(S0 below 0 or no number): b. Is --black-level right?"), std::string::npos)
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

TEST_F(DemosaicCommand, ItsFolderIsAnInputWithItsMasks) {
  WriteAngles("a", 0.8, 0.3, -0.1);
  WritePng(Input() / "masks/a.png", Image<std::uint8_t>(40, 30, 255));
  ASSERT_EQ(Run().exit_code, 0);
  const Outcome outcome =
      RunPolarscan({"demosaic", Views().string(), "-o", (folder_ / "again").string(), "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["input"]["kind"], "stokes");
  for (const char* name : {"a.tif", "masks/a.png"})
    EXPECT_EQ(HashFile(folder_ / "again" / name), HashFile(Views() / name)) << name;
}

TEST_F(DemosaicCommand, CheckSaysWhatAFolderOfPicturesIs) {
  WriteAngles("a", 0.8, 0.3, -0.1);
  WriteAngles("b", 0.8, 0.3, -0.1);
  WritePng(Input() / "masks/a.png", Image<std::uint8_t>(40, 30, 255));
  const auto check = [&] { return RunPolarscan({"check", Input().string()}); };
  const Outcome sound = check();
  EXPECT_EQ(sound.exit_code, kDone) << sound.err;
  for (const char* words : {"input: 2 views of 40x30, angles", "masks for 1, poses for 0: sound", "are full"})
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

TEST_F(DemosaicCommand, ItsOwnViewsAreAnInputToo) {
  WriteAngles("a", 0.8, 0.3, -0.1);
  ASSERT_EQ(Run().exit_code, 0);
  fs::create_directories(folder_ / "next");
  fs::copy_file(Views() / "a.tif", folder_ / "next/a.tif");
  const Outcome outcome =
      RunPolarscan({"demosaic", (folder_ / "next").string(), "-o", (folder_ / "again").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(HashFile(folder_ / "again/a.tif"), HashFile(Views() / "a.tif"));
}

}  // namespace
}  // namespace polarscan::test
