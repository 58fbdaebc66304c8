// SPDX-License-Identifier: Apache-2.0
// The models that COLMAP leaves: which is taken, when another is tried, what is refused or said of it.
#include <sqlite3.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "sfm_stage.h"

namespace polarscan {
namespace {

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

}  // namespace
}  // namespace polarscan
