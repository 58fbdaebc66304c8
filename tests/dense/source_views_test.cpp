// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/source_views.h"

#include <algorithm>

#include "tests/sfm/helpers.h"

namespace polarscan {
namespace {

double AxisAngleDegrees(const DenseView& a, const DenseView& b) {
  const Eigen::Vector3d x = a.cam_from_world.rotation.row(2), y = b.cam_from_world.rotation.row(2);
  return std::acos(x.dot(y)) * 180 / M_PI;
}

TEST(Scene, AxesOfARingMeetAtItsCentre) {
  std::vector<DenseView> views = Ring(12);
  const Eigen::Vector3d shift(3, -2, 5);
  for (DenseView& view : views)
    view.cam_from_world = view.cam_from_world * Rigid{Eigen::Matrix3d::Identity(), -shift};
  const auto centre = AxesIntersection(views);
  ASSERT_TRUE(centre);
  EXPECT_LT((*centre - shift).norm(), 1e-9);
  for (const double depth : FocusDepths(views, {})) EXPECT_NEAR(depth, 4, 1e-9);
}

TEST(Scene, ParallelAxesMeetNowhere) {
  std::vector<DenseView> views = Ring(5);
  for (int i = 0; i < 5; ++i)
    views[std::size_t(i)].cam_from_world = {Eigen::Matrix3d::Identity(), {-0.2 * i, 0, 0}};
  EXPECT_FALSE(AxesIntersection(views));
  for (const double depth : FocusDepths(views, {})) EXPECT_NEAR(depth, 2, 1e-9);  // ten baselines
}

TEST(Scene, PointsInFrontOfTwoViewsCount) {
  const std::vector<DenseView> views = Ring(4);
  SparseModel model = ModelOf(views);
  for (auto& [id, image] : model.images) image.observations.resize(2);
  model.points[1] = {{0.1, 0.2, 0.3}, {}, 0, {{12, 0}, {11, 0}, {11, 1}}};
  model.points[2] = {{0.1, 0.2, 0.3}, {}, 0, {{11, 0}, {11, 1}}};  // one view only
  model.points[3] = {views[0].cam_from_world.Inverse() * Eigen::Vector3d(0, 0, -1),
                     {},
                     0,
                     {{11, 0}, {12, 1}}};  // behind one
  const auto points = ScenePoints(model, views);
  ASSERT_EQ(points.size(), 1u);
  EXPECT_EQ(points[0].views, (std::vector<int>{0, 1}));
}

TEST(SourceViews, OnARingThoseAbout20DegreesAwayComeFirst) {
  const std::vector<DenseView> views = Ring(36, 4, 10);
  const auto sources = ChooseSourceViews(views, {}, 20);
  for (std::size_t i = 0; i < views.size(); ++i) {
    ASSERT_GE(sources[i].size(), 10u);
    for (int k = 0; k < 2; ++k)
      EXPECT_NEAR(AxisAngleDegrees(views[i], views[std::size_t(sources[i][std::size_t(k)])]), 20, 1);
    EXPECT_EQ((sources[i][0] + sources[i][1]) % 36, 2 * i % 36) << "one to each side";
    for (const int source : sources[i]) EXPECT_LT(AxisAngleDegrees(views[i], views[std::size_t(source)]), 80);
    EXPECT_EQ(std::ranges::count(sources[i], int(i)), 0);
  }
}

TEST(SourceViews, AFlatRowOfParallelCamerasFindsItsNeighbours) {
  std::vector<DenseView> views = Ring(9);
  for (int i = 0; i < 9; ++i)
    views[std::size_t(i)].cam_from_world = {Eigen::Matrix3d::Identity(), {-0.2 * i, 0, 0}};
  const auto sources = ChooseSourceViews(views, {}, 4);
  for (std::size_t i = 0; i < views.size(); ++i) {
    ASSERT_EQ(sources[i].size(), 4u);
    for (const int source : sources[i]) EXPECT_LE(std::abs(source - int(i)), 4);
  }
}

TEST(SourceViews, ViewsOfAnotherPlaceAreNotTaken) {
  std::vector<DenseView> views = Ring(12);
  for (std::size_t i = 6; i < 12; ++i)  // the second half looks outwards
    views[i].cam_from_world = LookAt(views[i].cam_from_world.Center(), 2 * views[i].cam_from_world.Center());
  const auto sources = ChooseSourceViews(views, {}, 20);
  for (std::size_t i = 0; i < 6; ++i)
    for (const int source : sources[i]) EXPECT_LT(source, 6);
}

TEST(SourceViews, SharedPointsDecideWhereThereAreEnough) {
  const std::vector<DenseView> views = Ring(12, 4, 10);
  std::vector<ScenePoint> points;  // view 0 shares points with views 2, 4, 5, 6, 7, 8 only, and most with 2
  for (const int other : {2, 2, 2, 4, 5, 6, 7, 8})
    for (int k = 0; k < 40; ++k) points.push_back({Eigen::Vector3d(0.01 * k, 0, 0), {0, other}});
  const auto sources = ChooseSourceViews(views, points, 20);
  EXPECT_EQ(sources[0][0], 2);
  EXPECT_EQ(std::ranges::count(sources[0], 1), 0);
  EXPECT_GE(std::ranges::count(sources[1], 0), 1) << "view 1 has no points and falls back on poses";
}

TEST(SourceViews, AngleScoreHasItsTopAt20Degrees) {
  EXPECT_DOUBLE_EQ(AngleScore(20), 1);
  for (const double angle : {0.0, 80.0, 120.0}) EXPECT_EQ(AngleScore(angle), 0);
  for (double angle = 1; angle < 20; ++angle) EXPECT_LT(AngleScore(angle), AngleScore(angle + 1));
  for (double angle = 20; angle < 79; ++angle) EXPECT_GT(AngleScore(angle), AngleScore(angle + 1));
}

TEST(Scene, FarFrom0ItIsCountedFromAPlaceNearItAndElseNotTouched) {
  const Eigen::Vector3d far_off(500000, 5400000, 300);
  for (const Eigen::Vector3d& shift : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(50, -20, 9), far_off}) {
    std::vector<DenseView> views = Ring(12);
    SparseModel model = ModelOf(views);
    model.points[1] = {{0.25, 0.5, 0}, {}, 0, {}};
    const SparseModel at_origin = model;
    MoveOrigin(model, -shift);
    model.offset = Eigen::Vector3d::Zero();
    Listener listener;
    MoveToLocalFrame(model, listener);
    const bool moved = shift == far_off;
    EXPECT_EQ(model.offset, moved ? far_off : Eigen::Vector3d(0, 0, 0));
    EXPECT_EQ(listener.Heard("offset 500000 5400000 300"), moved);
    if (!moved && shift.norm() > 0) continue;
    EXPECT_LT((model.points[1].position - at_origin.points.at(1).position).norm(), 1e-8);
    for (const auto& [id, image] : model.images)
      EXPECT_LT(
          (image.cam_from_world.translation - at_origin.images.at(id).cam_from_world.translation).norm(),
          1e-8);
  }
}

TEST(Scene, AnOffsetStaysWithItsModel) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "offset_model";
  std::filesystem::remove_all(folder);
  SparseModel model = ModelOf(Ring(3));
  WriteSparseModelText(folder, model);
  EXPECT_FALSE(std::filesystem::exists(folder / "offset.txt"));
  model.offset = {500000.125, -2, 1e7};
  WriteSparseModelText(folder, model);
  EXPECT_EQ(ReadSparseModel(folder).offset, model.offset);
  WriteFileAtomically(folder / "offset.txt", "1 2");
  EXPECT_NE(ErrorOf([&] { ReadSparseModel(folder); }).find("offset"), std::string::npos);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace polarscan
