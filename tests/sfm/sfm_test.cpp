// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/sfm.h"

#include <sqlite3.h>

#include <chrono>
#include <cstring>
#include <thread>

#include "fake_colmap.h"
#include "stereo/sfm/colmap/colmap.h"
#include "stereo/sfm/known_poses.h"
#include "stereo/sfm/pose_readings.h"

namespace polarscan {
namespace {

constexpr int kViews = 10;

// Ten views, and a COLMAP that places them all unless a test wants otherwise.
class Sfm : public FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    WriteViews(folder / "views", views);
    options.colmap = colmap().program();
    for (const DenseView& view : views) names.push_back(view.name + ".png");
    colmap().ExtractorWrites(names, 1000, kViews);
    colmap().MapperWrites({Registered(0, kViews)});
  }
  FakeColmap& colmap() {
    if (!colmap_) colmap_ = std::make_unique<FakeColmap>(folder / "fake", "3.8");
    return *colmap_;
  }
  // A model of the views begin .. end-1.
  SparseModel Registered(int begin, int end) const {
    return ModelOf({views.begin() + begin, views.begin() + end});
  }
  SparseModel Run() { return EstimatePoses(folder / "views", folder / "sfm", known, options, progress); }
  std::string RunError() {
    return ErrorOf([this] { Run(); });
  }

  std::vector<DenseView> views = Ring(kViews);
  std::vector<std::string> names;
  std::optional<std::filesystem::path> known;
  SfmOptions options;
  Listener progress;

 private:
  std::unique_ptr<FakeColmap> colmap_;
};

double FirstCameraParameter(const std::filesystem::path& path) {
  sqlite3* database = nullptr;
  EXPECT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  double value = 0;
  sqlite3_stmt* row = nullptr;
  EXPECT_EQ(sqlite3_prepare_v2(database, "SELECT params FROM cameras", -1, &row, nullptr), SQLITE_OK);
  EXPECT_EQ(sqlite3_step(row), SQLITE_ROW);
  std::memcpy(&value, sqlite3_column_blob(row, 0), sizeof value);
  sqlite3_finalize(row);
  sqlite3_close(database);
  return value;
}

bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

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

TEST_F(Sfm, TheLargestOfSeveralModelsIsTaken) {
  SparseModel with_points = Registered(1, 10);
  for (auto& [id, image] : with_points.images) image.observations.resize(1);
  for (const std::uint64_t id : {4u, 5u}) with_points.points[id] = {{0, 0, 0}, {}, 0.4, {{12, 0}, {13, 0}}};
  colmap().MapperWrites({Registered(0, 3), Registered(1, 10), with_points, Registered(5, 10)});
  const SparseModel model = Run();
  EXPECT_EQ(model.images.size(), 9u);
  EXPECT_EQ(model.points.size(), 2u);
  EXPECT_TRUE(progress.Heard("1 of 10 views could not be placed"));
}

TEST_F(Sfm, ADamagedModelIsSkipped) {
  colmap().MapperWrites({Registered(0, 10), Registered(0, 9)});
  const std::string bytes = ReadFile(folder / "fake/models/0/images.bin");
  WriteFileAtomically(folder / "fake/models/0/images.bin", bytes.substr(0, bytes.size() - 10));
  EXPECT_EQ(Run().images.size(), 9u);
  EXPECT_TRUE(progress.Heard("a model is skipped"));
}

TEST_F(Sfm, TooFewPlacedViewsAreAnErrorAndSomeAreAWarning) {
  colmap().MapperWrites({Registered(0, 3)});
  colmap().ExtractorWrites(names, 1000, 6);  // 006 to 009 match nothing
  const std::string message = RunError();
  EXPECT_TRUE(Contains(message, "only 3 of 10 views could be placed")) << message;
  EXPECT_TRUE(Contains(message, "no match with any other view for 006 to 009")) << message;
  EXPECT_TRUE(Contains(message, "too few matches for 003 (at most 50 with one view)")) << message;
  EXPECT_TRUE(Contains(message, "matches only with others that were not placed for 004, 005")) << message;
  options.min_registered = 0.2;
  EXPECT_EQ(Run().images.size(), 3u);
  EXPECT_TRUE(progress.Heard("only 3 of 10 views"));
}

TEST_F(Sfm, SmallPartsThatDoNotHangTogetherAreNamedAndTheLargestIsTaken) {
  colmap().ListsOption("Mapper.min_model_size");
  colmap().MapperWrites({Registered(7, 10), Registered(0, 6)});
  colmap().On("mapper", "tail -n 1 calls | grep -q 'min_model_size 3' && cp -r models/. $output");
  EXPECT_EQ(Run().images.size(), 6u);
  EXPECT_TRUE(Contains(colmap().calls(), "--Mapper.min_model_size 10")) << "tried before";
  EXPECT_TRUE(progress.Heard("only 6 of 10 views"));
  EXPECT_TRUE(progress.Heard("007 to 009 hang together but not with the rest (no matches between them)"));
  EXPECT_TRUE(progress.Heard("too few matches for 006 (at most 50"));
  EXPECT_TRUE(progress.Heard("lead from one part to the other"));
}

TEST_F(Sfm, ManyMatchesAreNotCalledTooFew) {
  colmap().MapperWrites({Registered(0, 9)});
  colmap().Matches(400);
  colmap().ExtractorWrites(names, 1000, kViews);
  EXPECT_EQ(Run().images.size(), 9u);
  EXPECT_TRUE(progress.Heard("1 of 10 views could not be placed"));
  EXPECT_TRUE(progress.Heard("matches, but no place that fits them, for 009"));
  EXPECT_FALSE(progress.Heard("too few"));
}

// Points at the origin, 4 from the cameras, whose focal length is 150 px.
SparseModel WithCamerasApart(SparseModel model, double parallax_px) {
  double extent = 0;
  for (const auto& [a, one] : model.images)
    for (const auto& [b, other] : model.images)
      extent = std::max(extent, (one.cam_from_world.Center() - other.cam_from_world.Center()).norm());
  const Eigen::Vector3d first = model.images.begin()->second.cam_from_world.Center();
  ColmapPoint point{{0, 0, 0}, {}, 0.3, {}};
  for (auto& [id, image] : model.images) {
    const Eigen::Vector3d centre =
        first + (image.cam_from_world.Center() - first) * (parallax_px / 150 * 4 / extent);
    image.cam_from_world = LookAt(centre, {0, 0, 0});
    image.observations.resize(1);
    point.track.push_back({id, 0});
  }
  model.points[1] = point;
  return model;
}

TEST_F(Sfm, CamerasThatHardlyMovedAreRefusedAndSmallBaselinesAreNot) {
  colmap().MapperWrites({WithCamerasApart(Registered(0, 10), 0.01)});
  const std::string message = RunError();
  EXPECT_TRUE(Contains(message, "the cameras hardly moved against the depth of what they see: by 0.01 px"))
      << message;
  EXPECT_TRUE(Contains(message, "stands still")) << message;
  EXPECT_TRUE(Contains(message, "--sfm-masks yes")) << message;
  const double one_degree_px = 150 * M_PI / 180;
  colmap().MapperWrites({WithCamerasApart(Registered(0, 10), one_degree_px)});
  EXPECT_EQ(Run().images.size(), 10u);
}

TEST_F(Sfm, LowerThresholdsAreTriedBeforeGivingUp) {
  WriteSparseModelBinary(folder / "fake/models2/0", WithPoint(Registered(0, 9)));
  colmap().MapperWrites({Registered(0, 3)});
  colmap().On("mapper",
              "case $output in *lenient) cp -r models2/. $output;; *) cp -r models/. $output;; esac");
  EXPECT_EQ(Run().images.size(), 9u);
}

TEST_F(Sfm, AModelOfOtherPicturesIsRefused) {
  SparseModel model = Registered(0, 10);
  model.images[13].name = "holiday.png";
  colmap().MapperWrites({model});
  EXPECT_TRUE(Contains(RunError(), "holiday.png"));
}

TEST_F(Sfm, DoubtfulPosesAreSaid) {
  SparseModel model = Registered(0, 10);
  model.cameras[3].params = {150, 110, 60, 50};
  for (auto& [id, image] : model.images) image.observations.resize(1);
  model.points[4] = {{0, 0, 0}, {}, 2.5, {{11, 0}, {12, 0}}};
  colmap().MapperWrites({model});
  Run();
  EXPECT_TRUE(progress.Heard("focal lengths 150 and 110 px"));
  EXPECT_TRUE(progress.Heard("2.5 px"));
}

// Focal lengths (the camera's first parameter) that the mapper finds in the database at each attempt.
TEST_F(Sfm, ADoubtfulModelIsTriedAgainFromOtherFocalLengths) {
  SparseModel wrong = Registered(0, 10), right = Registered(0, 10);
  for (SparseModel* model : {&wrong, &right}) {
    for (auto& [id, image] : model->images) image.observations.resize(1);
    model->points[4] = {{0, 0, 0}, {}, model == &wrong ? 1.4 : 0.4, {{11, 0}, {12, 0}}};
  }
  colmap().ExtractorGuessesFocalLength(100, 80);
  WriteSparseModelBinary(folder / "fake/models2/0", right);
  colmap().MapperWrites({wrong});
  colmap().On("mapper",
              "cp $database $output/../../$(basename $output).db\n"
              "case $output in *wide-lens) cp -r models2/. $output;; *) cp -r models/. $output;; esac");
  EXPECT_DOUBLE_EQ(Run().points.at(4).error_px, 0.4);
  for (const auto& [attempt, focal] : {std::pair{"first", 120.0}, {"long-lens", 240.0}, {"wide-lens", 70.0}})
    EXPECT_DOUBLE_EQ(FirstCameraParameter(folder / "sfm" / (std::string(attempt) + ".db")), focal) << attempt;
}

TEST_F(Sfm, AKnownFocalLengthIsNotDoubted) {
  SparseModel wrong = Registered(0, 10);
  for (auto& [id, image] : wrong.images) image.observations.resize(1);
  wrong.points[4] = {{0, 0, 0}, {}, 1.4, {{11, 0}, {12, 0}}};
  colmap().ExtractorGuessesFocalLength(100, 80);
  colmap().MapperWrites({wrong});
  options.focal_px = 90;
  Run();
  EXPECT_FALSE(Contains(colmap().calls(), "long-lens"));
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

TEST_F(Sfm, KnownPosesMatchByStemAndNeedNoColmap) {
  options.colmap = "no-such-colmap-here";
  SparseModel given = ModelOf(views, ".jpg");
  given.images[13].name = "left/002.tiff";
  given.images[99] = {99, 3, {}, "unused.jpg", {}};
  WriteSparseModelText(folder / "given", given);
  known = folder / "given";
  const SparseModel model = Run();
  ASSERT_EQ(model.images.size(), 10u);
  EXPECT_EQ(model.images.at(13).name, "002.png");
  EXPECT_LT((model.images.at(13).cam_from_world.rotation - views[2].cam_from_world.rotation).norm(), 1e-9);
}

TEST_F(Sfm, KnownPosesOfPicturesInFoldersMatchTheNamesOfTheirViews) {
  SparseModel given = Registered(0, 3);
  given.images[11].name = "cam1/0.jpg";
  given.images[12].name = "cam2/0.jpg";
  given.images[13].name = "images/cam3/0.jpg";
  given.images[14] = given.images[13];
  given.images[14].id = 14, given.images[14].name = "elsewhere.jpg";
  const auto select = [&](const std::string& name) {
    const SparseModel kept =
        SelectKnownPoses(given, {{name, 120, 100}, {"elsewhere", 120, 100}}, "the model");
    for (const auto& [id, image] : kept.images)
      if (image.name == name + ".png") return id;
    return 0u;
  };
  EXPECT_EQ(select("cam2-0"), 12u);
  EXPECT_EQ(select("cam3-0"), 13u);
  EXPECT_EQ(select("images-cam3-0"), 13u);
  EXPECT_TRUE(Contains(ErrorOf([&] { select("0"); }), "cam1/0.jpg and cam2/0.jpg"));
  given.images[13].name = "0.jpg";
  EXPECT_EQ(select("0"), 13u);
}

TEST_F(Sfm, KnownPosesOfOtherPicturesGiveExamplesOfBothNames) {
  SparseModel given = Registered(0, 2);
  given.images[11].name = "IMG_7.jpg";
  given.images[12].name = "IMG_8.jpg";
  WriteSparseModelText(folder / "given", given);
  known = folder / "given";
  const std::string message = RunError();
  EXPECT_TRUE(Contains(message, "IMG_7.jpg, IMG_8.jpg")) << message;
  EXPECT_TRUE(Contains(message, "000, 001, 002 and 7 more")) << message;
}

TEST_F(Sfm, KnownPosesScaleToThePicturesSize) {
  SparseModel given = ModelOf(views);
  given.cameras[3] = {3, "PINHOLE", 240, 200, {300, 300, 120, 100}};
  WriteSparseModelText(folder / "given", given);
  known = folder / "given";
  EXPECT_EQ(Run().cameras.at(3).params, (std::vector<double>{150, 150, 60, 50}));
  EXPECT_TRUE(progress.Heard("is for 240 x 200 pixels, the pictures have 120 x 100: it is scaled"));
  given.cameras[3].width = 300;
  WriteSparseModelText(folder / "given", given);
  EXPECT_TRUE(Contains(RunError(), "300 x 200"));
}

TEST_F(Sfm, MissingKnownPosesAreWarnedOf) {
  WriteSparseModelText(folder / "given", Registered(0, 7));
  known = folder / "given";
  EXPECT_EQ(Run().images.size(), 7u);
  EXPECT_TRUE(progress.Heard("7 of 10 views have a known pose; the model has none for 007 to 009"));
  for (const std::string& warning : progress.warnings) EXPECT_FALSE(Contains(warning, "match")) << warning;
}

TEST_F(Sfm, NamesOfKnownPosesMayLackFoldersAndExtensionsOrHaveOthers) {
  SparseModel given = ModelOf(views, "");
  given.images[12].name = "C:\\pictures\\001.jpg";
  given.images[13].name = "/home/me/002.png";
  given.images[14].name = "003.tar.gz";  // no view of ours
  WriteSparseModelText(folder / "given/0", given);
  known = folder / "given";
  EXPECT_EQ(Run().images.size(), 9u);
  EXPECT_TRUE(progress.Heard("none for 003,"));
  given.images[11].name = "right/000.png";
  given.images[15].name = "left/000.png";
  WriteSparseModelText(folder / "given/0", given);
  EXPECT_TRUE(Contains(RunError(), "the images right/000.png and left/000.png of the model are both named"));
}

TEST_F(Sfm, KnownPosesThatCannotBeAreSaid) {
  known = folder / "given";
  WriteSparseModelText(*known, Registered(0, 1));
  EXPECT_TRUE(Contains(RunError(), "only 1 of 10 views has a known pose"));
  SparseModel given = Registered(0, 10);
  for (auto& [id, image] : given.images)  // the camera's place instead of the translation's, say
    image.cam_from_world.translation = -(image.cam_from_world.rotation * Eigen::Vector3d(1, 2, 3));
  WriteSparseModelText(*known, given);
  EXPECT_TRUE(Contains(RunError(), "all cameras of the known poses stand at one place"));
  given = Registered(0, 10);
  given.cameras[3].params = {8, 8, 60, 50};  // millimetres
  WriteSparseModelText(*known, given);
  Run();
  EXPECT_TRUE(progress.Heard("Focal lengths and principal points are in pixels"));
  given.cameras[3].params = {2, 2, 60, 50};
  WriteSparseModelText(*known, given);
  EXPECT_TRUE(Contains(RunError(), "a focal length of 2 px for a picture 120 px wide"));
}

TEST_F(Sfm, PicturesOfOneKnownCameraMayDifferInSize) {
  WritePng(folder / "views/003.png", Image<std::uint8_t>(60, 50, 7));
  WriteStokes(folder / "views/003.tif", {{60, 50}, {60, 50}, {60, 50}, {}});
  WriteSparseModelText(folder / "given", ModelOf(views));
  known = folder / "given";
  const SparseModel model = Run();
  std::set<int> widths;
  for (const auto& [id, image] : model.images) {
    EXPECT_EQ(model.cameras.at(image.camera_id).width, image.name == "003.png" ? 60 : 120) << image.name;
    widths.insert(model.cameras.at(image.camera_id).width);
  }
  EXPECT_EQ(widths.size(), 2u);
  EXPECT_TRUE(progress.Heard("is for 120 x 100 pixels, the pictures have 60 x 50"));
}

TEST_F(Sfm, OnePictureWithKnownPosesIsSaidToBeTooFew) {
  known = folder / "given";
  WriteSparseModelText(*known, Registered(0, 1));
  const std::string error = ErrorOf([&] { ReadKnownPoses(*known, {{views[0].name, 120, 100}}, progress); });
  EXPECT_TRUE(Contains(error, "there is one picture only, 000")) << error;
}

// A ring of cameras that look at its middle, from different distances, its numbers written as `write` does.
SparseModel Written(const std::function<void(Rigid&)>& write) {
  SparseModel model;
  for (int i = 0; i < 9; ++i) {
    const double angle = 0.5 * i, far = 4 + 0.3 * (i % 3);
    const Eigen::Vector3d place(far * std::sin(angle), 1 + 0.2 * (i % 2), far * std::cos(angle));
    Rigid pose;
    const Eigen::Vector3d z = -place.normalized(), x = Eigen::Vector3d(0, -1, 0).cross(z).normalized();
    pose.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
    pose.translation = -(pose.rotation * place);
    write(pose);
    model.images[std::uint32_t(i)] = {std::uint32_t(i), 1, pose, "", {}};
  }
  return model;
}

TEST(PoseReadings, PosesOfAnotherConventionAreFoundOutAndRightOnesAreNot) {
  const auto to_world = [](Rigid& pose) { pose = pose.Inverse(); };
  const auto axes = [](Rigid& pose) {
    const Eigen::Matrix3d turn = Eigen::Vector3d(1, -1, -1).asDiagonal();
    pose = {turn * pose.rotation, turn * pose.translation};
  };
  EXPECT_EQ(OtherReading(Written([](Rigid&) {})), "");
  EXPECT_TRUE(
      Contains(OtherReading(Written(to_world)), "with the poses as those of the camera in the world"));
  EXPECT_TRUE(Contains(OtherReading(Written(axes)), "with the cameras' axes as y up"));
  const std::string both = OtherReading(Written([&](Rigid& pose) { axes(pose), to_world(pose); }));
  EXPECT_TRUE(Contains(both, "in the world (camera to world) and the cameras' axes as y up")) << both;
  SparseModel moved = Written(to_world);  // in a local frame
  moved.offset = {1, 2, 3};
  for (auto& [id, image] : moved.images)
    image.cam_from_world.translation += image.cam_from_world.rotation * moved.offset;
  EXPECT_EQ(OtherReading(moved), OtherReading(Written(to_world)));
}

TEST(PoseReadings, FlightsAndRoomsAreNotDoubted) {
  const SparseModel flight = Written([](Rigid& pose) {  // straight down
    const Eigen::Vector3d place = pose.Center();
    pose.rotation = Eigen::Vector3d(1, -1, -1).asDiagonal();
    pose.translation = -(pose.rotation * place);
  });
  EXPECT_EQ(OtherReading(flight), "");
  SparseModel room = Written([](Rigid& pose) {  // looks outward
    const Eigen::Matrix3d turn = Eigen::Vector3d(-1, 1, -1).asDiagonal();
    pose = {turn * pose.rotation, turn * pose.translation};
  });
  room.points[1] = {};  // found in its pictures
  EXPECT_EQ(OtherReading(room), "");
}

TEST_F(Sfm, RealColmapFindsNothingOnBlankPictures) {
  if (!HasColmap()) GTEST_SKIP() << "COLMAP is not installed";
  for (const std::string& name : names) WritePng(folder / "views" / name, Image<std::uint8_t>(120, 100, 99));
  options.colmap = "colmap";
  EXPECT_TRUE(Contains(RunError(), "no feature in any picture"));
}

TEST(ColmapHelp, OptionNamesAreFoundInAnyLayout) {
  const auto names = OptionNames(
      "passed to `--project_path`.\n\n  -h [ --help ] \n  --Sift.use_gpu arg (=1)\nI0101 x.cc:1] --a_b {x, "
      "y}");
  EXPECT_EQ(names, (std::set<std::string>{"project_path", "help", "Sift.use_gpu", "a_b"}));
}

}  // namespace
}  // namespace polarscan
