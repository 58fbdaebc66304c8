// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/sfm.h"

#include <set>

#include "sfm_stage.h"
#include "stereo/sfm/colmap/colmap.h"

namespace polarscan {
namespace {

TEST_F(Sfm, PlacesViewsAndKeepsTheResult) {
  EXPECT_EQ(Run().images.size(), 10u);
  EXPECT_TRUE(progress.warnings.empty());
  EXPECT_TRUE(Contains(colmap().calls(), "exhaustive_matcher"));
  EXPECT_EQ(ReadSparseModel(folder / "sfm/model").images.size(), 10u);
  EXPECT_TRUE(Contains(ReadFile(folder / "sfm/colmap.log"), "feature_extractor --database_path"));
}

TEST_F(Sfm, AValidResultIsTakenWithoutRunningAnything) {
  Run();
  const std::string calls = colmap().calls();
  options.colmap = "no-such-colmap";  // must not even be looked for
  options.colmap = colmap().program();
  EXPECT_EQ(Run().images.size(), 10u);
  EXPECT_EQ(colmap().calls(), calls);
  options.max_features = 500;
  Run();
  EXPECT_NE(colmap().calls(), calls) << "other options: made again";
}

TEST_F(Sfm, ADamagedResultIsMadeAgain) {
  Run();
  WriteFileAtomically(folder / "sfm/model/images.bin", "xyz");
  EXPECT_EQ(Run().images.size(), 10u);
  EXPECT_EQ(ReadSparseModel(folder / "sfm/model").images.size(), 10u);
}

TEST_F(Sfm, ChangedPicturesAreNoticed) {
  Run();
  const std::string calls = colmap().calls();
  WritePng(folder / "views/003.png", Image<std::uint8_t>(120, 100, 7));
  Run();
  EXPECT_NE(colmap().calls(), calls);
}

TEST_F(Sfm, GraphicsCardsAreSwitchedOffInTheWordsOfEachRelease) {
  Run();
  EXPECT_TRUE(Contains(colmap().calls(), "--SiftExtraction.use_gpu 0"));
  EXPECT_TRUE(Contains(colmap().calls(), "--SiftMatching.use_gpu 0"));
  EXPECT_TRUE(Contains(colmap().calls(), "--Mapper.ba_global_use_pba 0"));
  FakeColmap newer(folder / "newer", "4.0");
  newer.ExtractorWrites(names, 1000, kViews);
  newer.MapperWrites({Registered(0, kViews)});
  options.colmap = newer.program();
  Run();
  EXPECT_TRUE(Contains(newer.calls(), "--FeatureExtraction.use_gpu 0"));
  EXPECT_TRUE(Contains(newer.calls(), "--FeatureMatching.use_gpu 0"));
  EXPECT_TRUE(Contains(newer.calls(), "--Mapper.ba_use_gpu 0"));
  EXPECT_FALSE(Contains(newer.calls(), "SiftMatching"));
  EXPECT_FALSE(Contains(newer.calls(), "--random_seed"));
}

TEST_F(Sfm, MatchesAreFoundByUsAndVerifiedByColmapWhereItCanImportThem) {
  colmap().ImportsMatches();
  colmap().ExtractorWrites(names, 20, kViews);
  EXPECT_EQ(Run().images.size(), 10u);
  EXPECT_TRUE(Contains(colmap().calls(), "matches_importer"));
  EXPECT_TRUE(Contains(colmap().calls(), "--match_type raw"));
  EXPECT_FALSE(Contains(colmap().calls(), "exhaustive_matcher"));
  EXPECT_TRUE(std::filesystem::exists(folder / "sfm/matches.txt"));
}

TEST_F(Sfm, AfterAStopTheDatabaseIsGoneOnWith) {
  colmap().On("mapper", "exit 1");
  RunError();
  colmap().MapperWrites({Registered(0, 10)});
  Run();
  EXPECT_EQ(ReadFile(folder / "fake/extractions"), "anew\n");
  std::filesystem::remove_all(folder / "sfm/model");
  WriteFileAtomically(folder / "sfm/database.db", "power cut");
  EXPECT_EQ(Run().images.size(), 10u) << "a damaged one is replaced";
  EXPECT_EQ(ReadFile(folder / "fake/extractions"), "anew\nanew\n");
}

TEST_F(Sfm, PicturesOfSeveralSizesGetACameraEach) {
  WritePng(folder / "views/003.png", Image<std::uint8_t>(100, 120, 7));
  Run();
  EXPECT_TRUE(progress.Heard("different sizes"));
  EXPECT_TRUE(Contains(colmap().calls(), "--ImageReader.single_camera 0"));
}

TEST_F(Sfm, AKnownFocalLengthGoesToColmap) {
  options.focal_px = 150;
  Run();
  EXPECT_TRUE(Contains(colmap().calls(), "--ImageReader.camera_params 150,60,50,0"));
}

TEST_F(Sfm, ADamagedPictureIsNamedBeforeColmapRuns) {
  const std::string bytes = ReadFile(folder / "views/005.png");
  WriteFileAtomically(folder / "views/005.png", bytes.substr(0, bytes.size() / 2));
  EXPECT_TRUE(Contains(RunError(), "005.png"));
  EXPECT_EQ(colmap().calls(), "");
}

TEST_F(Sfm, OneViewIsNotEnough) {
  for (int i = 1; i < kViews; ++i)
    std::filesystem::remove(folder / "views" / (views[std::size_t(i)].name + ".tif"));
  EXPECT_TRUE(Contains(RunError(), "at least 2"));
}

TEST(ColmapHelp, OptionNamesAreFoundInAnyLayout) {
  const auto names = OptionNames(
      "passed to `--project_path`.\n\n  -h [ --help ] \n  --Sift.use_gpu arg (=1)\nI0101 x.cc:1] --a_b {x, "
      "y}");
  EXPECT_EQ(names, (std::set<std::string>{"project_path", "help", "Sift.use_gpu", "a_b"}));
}

}  // namespace
}  // namespace polarscan
