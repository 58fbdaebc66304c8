// SPDX-License-Identifier: Apache-2.0
// `polarscan demosaic`: what it makes of which input, and what it keeps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/files/files.h"
#include "demosaic/stokes.h"
#include "demosaic_command.h"

namespace polarscan::test {
namespace {

namespace fs = std::filesystem;

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
