// SPDX-License-Identifier: Apache-2.0
// Bad input, bad disks and missing programs, through the program as users meet them: a message that says what
// happened, where and what to do; the right exit code; nothing that was there is lost, and the same command
// works once the cause is gone.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>

#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "core/random.h"
#include "program.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

Image<std::uint8_t> Noise(int width, int height, std::uint64_t seed) {
  Image<std::uint8_t> image(width, height);
  Random random(seed);
  for (std::uint8_t& pixel : image.pixels()) pixel = std::uint8_t(40 + random.Below(160));
  return image;
}

// Four angle folders with `views` pictures each.
void WriteAngleFolders(const fs::path& folder, int views, int width = 64, int height = 48) {
  for (const char* angle : {"I-00", "I-45", "I-90", "I-135"})
    for (int i = 0; i < views; ++i)
      WritePng(folder / angle / ("00" + std::to_string(i) + ".png"), Noise(width, height, std::uint64_t(i)));
}

void WriteMosaics(const fs::path& folder, int views) {
  for (int i = 0; i < views; ++i)
    WritePng(folder / "mosaic" / ("00" + std::to_string(i) + ".png"), Noise(64, 48, std::uint64_t(i)));
}

// COLMAP text model of views on a circle that look at the origin.
void WriteRing(const fs::path& folder, const std::vector<std::string>& names, int width, int height) {
  std::string images;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const double half = M_PI * double(i) / double(names.size());  // half of the angle around y
    images += std::to_string(i + 1) + " " + std::to_string(std::cos(half)) + " 0 " +
              std::to_string(std::sin(half)) + " 0 0 0 4 1 " + names[i] + "\n\n";
  }
  WriteFileAtomically(folder / "cameras.txt",
                      "1 PINHOLE " + std::to_string(width) + " " + std::to_string(height) + " 80 80 " +
                          std::to_string(width / 2) + " " + std::to_string(height / 2) + "\n");
  WriteFileAtomically(folder / "images.txt", images);
  WriteFileAtomically(folder / "points3D.txt", "");
}

// Exit code 1, and a message with all the words; nothing on stdout.
void ExpectFailure(const Outcome& outcome, const std::vector<std::string>& words) {
  EXPECT_EQ(outcome.exit_code, kFailed) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  for (const std::string& word : words)
    EXPECT_NE(outcome.err.find(word), std::string::npos) << word << "\n" << outcome.err;
}

class BadInput : public testing::Test {
 protected:
  // The failing command must leave the input as it was.
  Outcome Reconstruct(const std::vector<std::string>& more = {},
                      const std::map<std::string, std::string>& environment = {}) {
    std::vector<std::string> arguments = {"reconstruct", input().string(), "-o", scan().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto before = Contents(input());
    const Outcome outcome = RunPolarscan(arguments, environment);
    EXPECT_TRUE(before == Contents(input())) << "the input folder was changed";
    return outcome;
  }
  fs::path input() const { return folder_ / "input"; }
  fs::path scan() const { return folder_ / "scan"; }

  TemporaryFolder folder_;
};

TEST_F(BadInput, AnEmptyFolderIsNamedAndNothingIsMade) {
  fs::create_directory(input());
  ExpectFailure(Reconstruct(), {input().string()});
  EXPECT_FALSE(fs::exists(scan()));
}

TEST_F(BadInput, AMissingFolderIsWrongUsage) {
  const Outcome outcome =
      RunPolarscan({"reconstruct", (folder_ / "nowhere").string(), "-o", scan().string()});
  EXPECT_EQ(outcome.exit_code, kWrongUsage) << outcome.err;
  EXPECT_NE(outcome.err.find("nowhere"), std::string::npos);
}

TEST_F(BadInput, AngleFoldersWithDifferentCountsNameTheMissingPicture) {
  WriteAngleFolders(input(), 3);
  fs::remove(input() / "I-90" / "002.png");
  ExpectFailure(Reconstruct(), {"I-90", "002"});
}

TEST_F(BadInput, AngleFoldersWithDifferentSizesNameTheView) {
  WriteAngleFolders(input(), 3);
  WritePng(input() / "I-45" / "001.png", Noise(32, 48, 1));
  ExpectFailure(Reconstruct(), {"001", "32"});
}

TEST_F(BadInput, ATruncatedPngIsNamed) {
  WriteAngleFolders(input(), 3);
  const fs::path victim = input() / "I-135" / "001.png";
  fs::resize_file(victim, fs::file_size(victim) / 2);
  ExpectFailure(Reconstruct(), {victim.string()});
}

TEST_F(BadInput, AWrongLayoutNameShowsARightOne) {
  WriteMosaics(input(), 3);
  ExpectFailure(Reconstruct({"--layout", "90 45 / 90 0"}), {"90 45 / 90 0", "90 45 / 135 0"});
}

TEST_F(BadInput, ASparseModelThatNamesNoneOfTheViewsIsNamed) {
  WriteAngleFolders(input(), 3);
  WriteRing(input() / "sparse", {"left.png", "right.png", "top.png"}, 64, 48);
  ExpectFailure(Reconstruct(), {(input() / "sparse").string(), "000"});
}

TEST_F(BadInput, BlankPicturesDoNotRegisterAndTheMessageSaysWhatToDo) {
  if (!HasProgram("colmap")) GTEST_SKIP() << "COLMAP is not installed";
  for (int i = 0; i < 3; ++i)
    WritePng(input() / ("00" + std::to_string(i) + ".png"), Image<std::uint8_t>(64, 48, 128));
  ExpectFailure(Reconstruct({"--input-kind", "photos"}), {"feature", "printed sheet"});
  // What was done stays done: the views are there for the next try.
  EXPECT_EQ(ReadJson(scan() / "scan.json")["stages"]["views"]["state"], "done");
  EXPECT_EQ(ReadJson(scan() / "scan.json")["stages"]["sfm"]["state"], "failed");
}

TEST_F(BadInput, PicturesOfDifferentThingsDoNotRegisterAndTheMessageSaysWhatToDo) {
  if (!HasProgram("colmap")) GTEST_SKIP() << "COLMAP is not installed";
  for (int i = 0; i < 3; ++i)
    WritePng(input() / ("00" + std::to_string(i) + ".png"), Noise(160, 120, std::uint64_t(i)));
  ExpectFailure(Reconstruct({"--input-kind", "photos"}), {"match", "overlap"});
}

TEST_F(BadInput, WithoutColmapTheMessageNamesThePackage) {
  WriteAngleFolders(input(), 3);
  ExpectFailure(Reconstruct({}, {{"PATH", folder_.path().string()}}), {"colmap"});
}

TEST_F(BadInput, AnUnknownOptionIsWrongUsage) {
  WriteAngleFolders(input(), 3);
  EXPECT_EQ(Reconstruct({"--window-size", "3"}).exit_code, kWrongUsage);
  EXPECT_EQ(Reconstruct({"--preset", "fastest"}).exit_code, kWrongUsage);
  EXPECT_EQ(Reconstruct({"--window-radius", "-1"}).exit_code, kWrongUsage);
  EXPECT_EQ(RunPolarscan({"reconstrukt"}).exit_code, kWrongUsage);
  EXPECT_EQ(RunPolarscan({}).exit_code, kWrongUsage);
  EXPECT_FALSE(fs::exists(scan()));
}

TEST_F(BadInput, AFolderWithOtherFilesIsNotTakenForAScan) {
  WriteAngleFolders(input(), 3);
  WriteFileAtomically(scan() / "thesis.txt", "irreplaceable");
  ExpectFailure(Reconstruct(), {scan().string()});
  EXPECT_EQ(ReadFile(scan() / "thesis.txt"), "irreplaceable");
}

TEST_F(BadInput, AScanOfAnotherInputIsNotOverwritten) {
  WriteAngleFolders(input(), 3);
  WriteJson(scan() / "scan.json", {{"input", "/elsewhere"}, {"stages", nlohmann::json::object()}});
  ExpectFailure(Reconstruct(), {"/elsewhere", scan().string()});
  EXPECT_EQ(ReadJson(scan() / "scan.json")["input"], "/elsewhere");
}

TEST_F(BadInput, AnOutputBelowAFileIsRefused) {
  WriteAngleFolders(input(), 3);
  WriteFileAtomically(folder_ / "file", "content");
  const Outcome outcome =
      RunPolarscan({"reconstruct", input().string(), "-o", (folder_ / "file/scan").string()});
  ExpectFailure(outcome, {(folder_ / "file").string()});
  EXPECT_EQ(ReadFile(folder_ / "file"), "content");
}

// Runs the program with a small file system of its own mounted at `mount`.
Outcome RunOnOwnDisk(const fs::path& mount, const std::string& mount_options,
                     const std::vector<std::string>& arguments) {
  const std::string script = "mount -t tmpfs -o " + mount_options + " tmpfs \"$0\" && exec \"$@\"";
  std::vector<std::string> argv = {"unshare", "--map-root-user", "--mount", "sh", "-c",
                                   script,    mount.string()};
  const std::vector<std::string> program = Polarscan(arguments);
  argv.insert(argv.end(), program.begin(), program.end());
  return Process(argv).Wait();
}

bool MayMount(const fs::path& mount) {
  const std::vector<std::string> argv = {"unshare", "--map-root-user", "--mount", "mount",
                                         "-t",      "tmpfs",           "tmpfs",   mount.string()};
  return HasProgram("unshare") && Process(argv).Wait().exit_code == 0;
}

TEST_F(BadInput, AReadOnlyOutputIsNamed) {
  WriteAngleFolders(input(), 3);
  fs::create_directory(folder_ / "disk");
  if (!MayMount(folder_ / "disk"))
    GTEST_SKIP() << "this system does not let us mount a file system of our own";
  const Outcome outcome = RunOnOwnDisk(
      folder_ / "disk", "ro", {"reconstruct", input().string(), "-o", (folder_ / "disk/scan").string()});
  ExpectFailure(outcome, {(folder_ / "disk/scan").string(), "Read-only"});
}

TEST_F(BadInput, AFullOutputDiskIsNamed) {
  WriteAngleFolders(input(), 3, 400, 300);
  fs::create_directory(folder_ / "disk");
  if (!MayMount(folder_ / "disk"))
    GTEST_SKIP() << "this system does not let us mount a file system of our own";
  const Outcome outcome =
      RunOnOwnDisk(folder_ / "disk", "size=300k",
                   {"reconstruct", input().string(), "-o", (folder_ / "disk/scan").string()});
  ExpectFailure(outcome, {(folder_ / "disk/scan").string(), "disk full"});
}

}  // namespace
}  // namespace polarscan::test
