// SPDX-License-Identifier: Apache-2.0
// COLMAP that is missing, dies, hangs or leaves too little: what is said, and that its exit code is not
// believed.
#include <chrono>
#include <thread>

#include "sfm_stage.h"

namespace polarscan {
namespace {

TEST_F(Sfm, ACommandThatDiesHalfWayIsSaid) {
  colmap().On("exhaustive_matcher", "cp matched.db $database; kill -ABRT $$");
  EXPECT_EQ(Run().images.size(), 10u);
  EXPECT_TRUE(progress.Heard("exhaustive_matcher ended with exit code 134"));
}

// As COLMAP 3.8 without CUDA: with its own options it looks for a display and dies where there is none.
TEST_F(Sfm, AColmapThatDiesWithoutADisplayIsNeverAskedForIt) {
  const std::string dies = "tail -n 1 calls | grep -q 'use_gpu 0' || kill -ABRT $$; ";
  colmap().On("feature_extractor", dies + "cp prepared.db $database");
  colmap().On("exhaustive_matcher", dies + "cp matched.db $database");
  EXPECT_EQ(Run().images.size(), 10u);
  EXPECT_TRUE(progress.warnings.empty());
}

// Exit code 134, and a database or model that ends anywhere.
TEST_F(Sfm, AModelThatColmapLeftHalfWrittenIsSaid) {
  colmap().On("mapper",
              "cp -r models/. $output; for f in $output/0/*.bin; do truncate -s 20 $f; done; kill -ABRT $$");
  const std::string message = RunError();
  EXPECT_TRUE(Contains(message, "only 0 of 10 views could be placed")) << message;
  EXPECT_TRUE(progress.Heard("exit code 134"));
}

TEST_F(Sfm, ADatabaseThatColmapLeftHalfWrittenIsSaid) {
  colmap().On("feature_extractor", "head -c 3000 prepared.db >$database; exit 0");
  const std::string message = RunError();
  EXPECT_TRUE(Contains(message, (folder / "sfm").string())) << message;
}

TEST_F(Sfm, AMissingColmapComesWithTheCommandThatInstallsIt) {
  options.colmap = "no-such-colmap-here";
  EXPECT_TRUE(Contains(RunError(), "sudo apt install colmap"));
  options.colmap = "/bin/true";
  EXPECT_TRUE(Contains(RunError(), "does not say that it is COLMAP"));
}

TEST_F(Sfm, ExitCodeZeroWithAnEmptyDatabaseIsAnError) {
  colmap().ExtractorWrites({}, 0, 0);
  const std::string message = RunError();
  EXPECT_TRUE(Contains(message, "did not read 10 of 10 pictures")) << message;
}

TEST_F(Sfm, PicturesThatColmapSkippedAreNamed) {
  std::vector<std::string> some = names;
  some.erase(some.begin() + 4);
  colmap().ExtractorWrites(some, 1000, 9);
  EXPECT_TRUE(Contains(RunError(), "(004.png)"));
}

TEST_F(Sfm, NoDatabaseAtAllQuotesColmapsComplaint) {
  colmap().On("feature_extractor", "echo 'ERROR: unrecognised option --x'; exit 1");
  EXPECT_TRUE(Contains(RunError(), "unrecognised option --x"));
}

TEST_F(Sfm, PicturesWithoutFeaturesAreAnErrorWithACure) {
  colmap().ExtractorWrites(names, 0, 0);
  EXPECT_TRUE(Contains(RunError(), "no feature in any picture"));
}

TEST_F(Sfm, PicturesWithoutMatchesAreAnErrorWithACure) {
  colmap().ExtractorWrites(names, 1000, 0);
  EXPECT_TRUE(Contains(RunError(), "no two pictures that match"));
}

TEST_F(Sfm, NoModelNamesTheCauses) {
  colmap().On("mapper", "exit 1");
  const std::string message = RunError();
  EXPECT_TRUE(Contains(message, "only 0 of 10 views could be placed")) << message;
  EXPECT_TRUE(Contains(message, "overlap"));
}

TEST_F(Sfm, AHangingColmapStopsWithinASecond) {
  colmap().On("mapper", "touch hanging; sleep 60");
  std::chrono::steady_clock::time_point start;
  std::thread user([&] {
    while (!std::filesystem::exists(folder / "fake/hanging"))
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    start = std::chrono::steady_clock::now();
    progress.Cancel();
  });
  EXPECT_THROW(Run(), Cancelled);
  user.join();
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(1));
}

TEST_F(Sfm, RealColmapFindsNothingOnBlankPictures) {
  if (!HasColmap()) GTEST_SKIP() << "COLMAP is not installed";
  for (const std::string& name : names) WritePng(folder / "views" / name, Image<std::uint8_t>(120, 100, 99));
  options.colmap = "colmap";
  EXPECT_TRUE(Contains(RunError(), "no feature in any picture"));
}

}  // namespace
}  // namespace polarscan
