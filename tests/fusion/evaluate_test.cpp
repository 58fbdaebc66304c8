// SPDX-License-Identifier: Apache-2.0
#include "evaluation/evaluate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "evaluation/error_statistics.h"
#include "evaluation/thresholds.h"
#include "tests/fusion/similarity.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {
namespace {

using nlohmann::json;

// Points of a square grid in the plane z = height.
std::vector<Eigen::Vector3d> Grid(double from_x, double to_x, double half_y, double spacing, double height) {
  std::vector<Eigen::Vector3d> points;
  for (double x = from_x; x <= to_x + 1e-9; x += spacing)
    for (double y = -half_y; y <= half_y + 1e-9; y += spacing) points.emplace_back(x, y, height);
  return points;
}

json EvaluatePoints(const std::vector<Eigen::Vector3d>& points, const Truth& truth,
                    EvaluateOptions options = {}, const std::vector<DenseView>& cameras = {}) {
  Progress progress;
  options.samples = 50000;
  return EvaluateCloud(points, cameras, truth, options, 1, progress);
}

TEST(Statistics, PercentilesInterpolateAsNumpyDoes) {
  EXPECT_DOUBLE_EQ(Percentile({4, 1, 3, 2}, 50), 2.5);
  EXPECT_DOUBLE_EQ(Percentile({4, 1, 3, 2}, 90), 3.7);
  EXPECT_DOUBLE_EQ(Percentile({5}, 90), 5);
  EXPECT_DOUBLE_EQ(Percentile({1, 2, 3}, 100), 3);
}

TEST(Statistics, MissingPixelsCountWithThePenalty) {
  const json r = PixelErrors({0.01, 0.03, 0.2}, 5, 0.05, {0.02, 0.1});
  EXPECT_DOUBLE_EQ(r["mean"], 0.08);
  EXPECT_DOUBLE_EQ(r["median"], 0.03);
  EXPECT_DOUBLE_EQ(r["over_all"]["mean"], (0.01 + 0.03 + 3 * 0.05) / 5);
  EXPECT_DOUBLE_EQ(r["over_all"]["median"], 0.05);
  EXPECT_DOUBLE_EQ(r["within"]["0.02"], 1 / 3.);
  EXPECT_DOUBLE_EQ(r["over_all"]["within"]["0.1"], 0.4);
}

TEST(Statistics, TheCurveOfEvenlySpacedErrorsIsALine) {
  std::vector<double> errors;
  for (int i = 0; i < 1000; ++i) errors.push_back((i + 0.5) / 1000);
  ErrorCurve curve(0.5);
  curve.Add(errors);
  const json whole = curve.ToJson();
  EXPECT_EQ(whole["end"], 0.5);
  ASSERT_EQ(whole["shares"].size(), 101u);
  for (std::size_t i = 0; i <= 100; ++i) EXPECT_NEAR(whole["shares"][i], 0.005 * double(i), 1e-12);
  curve.AddMissing(1000);
  EXPECT_NEAR(curve.ToJson()["shares"][100], 0.25, 1e-12);
  EXPECT_TRUE(ErrorCurve(1).ToJson().is_null());
}

TEST(Statistics, ThresholdListsAreParsedAndBadOnesRefused) {
  EXPECT_EQ(ParseThresholds("0.5, 1 2", 10), (std::vector<double>{5, 10, 20}));
  for (const char* bad : {"", "a", "1,,x", "0", "-1", "1;2"})
    EXPECT_THROW(ParseThresholds(bad, 1), Error) << bad;
}

TEST(Unit, IsTheObjectsRadiusRoundedToOneTwoOrFive) {
  const auto unit = [](double radius) { return ObjectUnit(SquareMesh(radius / std::sqrt(2.), 0)); };
  EXPECT_DOUBLE_EQ(unit(1.03), 1);
  EXPECT_DOUBLE_EQ(unit(0.98), 1);
  EXPECT_DOUBLE_EQ(unit(47), 50);
  EXPECT_DOUBLE_EQ(unit(0.0022), 0.002);
  EXPECT_DOUBLE_EQ(unit(8), 10);
}

TEST(Cloud, PointsOffAPlaneHaveTheOffsetAsAccuracy) {
  const Truth truth(SquareMesh(1, 0), {});
  EvaluateOptions options;
  options.unit = 1;
  const json r = EvaluatePoints(Grid(-0.9, 0.9, 0.9, 0.01, 0.0125), truth, options);
  EXPECT_NEAR(r["accuracy"]["mean"], 0.0125, 1e-9);
  EXPECT_NEAR(r["accuracy"]["p90"], 0.0125, 1e-9);
  EXPECT_DOUBLE_EQ(r["thresholds"]["0.01"]["precision"], 0);
  EXPECT_DOUBLE_EQ(r["thresholds"]["0.02"]["precision"], 1);
  EXPECT_NEAR(r["completeness"]["median"], std::hypot(0.0125, 0.0038),
              5e-4);  // 0.0038: half of a 0.01 cell is nearer
}

TEST(Cloud, HalfOfASurfaceHasHalfOfTheRecall) {
  const Truth truth(SquareMesh(1, 0), {});
  EvaluateOptions options;
  options.unit = 1;
  options.cap = 0.1;
  const json r = EvaluatePoints(Grid(-1, 0, 1, 0.01, 0), truth, options);
  EXPECT_NEAR(r["thresholds"]["0.01"]["recall"], 0.505, 0.006);
  EXPECT_DOUBLE_EQ(r["thresholds"]["0.01"]["precision"], 1);
  EXPECT_NEAR(r["thresholds"]["0.01"]["F"], 2 * 0.505 / 1.505, 0.006);
  EXPECT_NEAR(r["completeness"]["mean"], (0.5 * 0.0038 + 0.05 * 0.05 + 0.45 * 0.1),
              0.001);  // capped beyond 0.1
}

TEST(Cloud, PointsOfTheTableDoNotCountAndStraysDo) {
  const std::vector<Eigen::Vector3d> object = Grid(-0.9, 0.9, 0.9, 0.02, 0.001);
  std::vector<Eigen::Vector3d> points = object;
  for (const Eigen::Vector3d& p : Grid(-2, 2, 2, 0.05, -0.9)) points.push_back(p);
  points.emplace_back(0, 0, 0.5);  // a stray above the object
  const Truth alone(SquareMesh(1, 0), {}), on_table(SquareMesh(1, 0), {SquareMesh(3, -1)});
  EXPECT_GT(EvaluatePoints(points, alone)["accuracy"]["p90"], 0.5);
  const json r = EvaluatePoints(points, on_table);
  EXPECT_EQ(r["points_of_surroundings"], points.size() - object.size() - 1);
  EXPECT_NEAR(r["accuracy"]["mean"], (0.001 * double(object.size()) + 0.5) / double(object.size() + 1), 1e-9);

  EvaluateOptions options;
  options.crop = 0.1;
  const json cropped = EvaluatePoints(points, alone, options);
  EXPECT_EQ(cropped["points_cropped"], points.size() - object.size());
  EXPECT_NEAR(cropped["accuracy"]["mean"], 0.001, 1e-9);
}

TEST(Cloud, OnlySurfaceThatCamerasSeeCounts) {
  const Truth truth(SphereMesh(100), {});
  std::vector<DenseView> cameras = {
      {"one", {200, 200, 150, 150, 100, 100}, LookAtOrigin({0, 0, 4}), 1, 9, {}}};
  EvaluateOptions options;
  options.seen_by = 1;
  const std::vector<Eigen::Vector3d> points = SphereMesh(50).vertices;
  // The cap that is seen from distance 4 is (1 - 1/4) / 2 of the sphere.
  EXPECT_NEAR(EvaluatePoints(points, truth, options, cameras)["visible_share"], 0.375, 0.005);
  cameras.push_back({"two", cameras[0].camera, LookAtOrigin({0, 0, -4}), 1, 9, {}});
  EXPECT_NEAR(EvaluatePoints(points, truth, options, cameras)["visible_share"], 0.75, 0.005);
  options.seen_by = 2;
  EXPECT_NEAR(EvaluatePoints(points, truth, options, cameras)["visible_share"], 0, 1e-9);
  options.seen_by = 0;
  EXPECT_NEAR(EvaluatePoints(points, truth, options, cameras)["visible_share"], 1, 1e-9);
  options.seen_by = 1;  // a screen before the first camera
  const Truth hidden(SphereMesh(100), {SquareMesh(2, 2)});
  EXPECT_NEAR(EvaluatePoints(points, hidden, options, cameras)["visible_share"], 0.375, 0.005);
}

TEST(Cloud, NothingLeftToCompareIsAnError) {
  const Truth truth(SquareMesh(1, 0), {SquareMesh(1, -5)});
  EXPECT_THROW(EvaluatePoints({{0, 0, -4.9}}, truth), Error);
}

class MapErrors : public ::testing::Test {
 protected:
  json Mean() { return Mean({}, truth_, {}); }
  json Mean(const Similarity& truth_from_scan, const Truth& truth, const EvaluateOptions& options) {
    Progress progress;
    return EvaluateMaps(workspace_, truth_from_scan, truth, options, progress).at("mean");
  }

  TemporaryFolder folder_;
  Workspace workspace_ = SphereWorkspace(folder_.path(), 3);
  Truth truth_{SphereMesh(300), {}};
};

TEST_F(MapErrors, AreNearlyZeroForExactMaps) {
  WriteSphere(workspace_);
  const json mean = Mean();
  EXPECT_LT(mean["depth"]["median"], 1e-4);
  EXPECT_LT(mean["normal_degrees"]["median"], 0.03);
  EXPECT_GT(mean["completeness"], 0.995);
  EXPECT_LT(mean["beyond"], 0.005);
}

TEST_F(MapErrors, AreTheOffsetAndTheTiltThatWerePutIn) {
  const Eigen::AngleAxisf tilt(0.1f, Eigen::Vector3f::UnitZ());
  WriteSphere(workspace_, [&](int, SphereMaps& maps) {
    for (float& depth : maps.depth.pixels())
      if (depth > 0) depth += 0.015f;
    for (Eigen::Vector3f& n : maps.normal.pixels()) n = 3 * (tilt * n);  // its length does not matter
  });
  const json mean = Mean();
  EXPECT_NEAR(mean["depth"]["median"], 0.015, 1e-4);
  EXPECT_LT(mean["depth"]["within"]["0.01"], 0.02);
  EXPECT_GT(mean["depth"]["within"]["0.02"], 0.98);
  EXPECT_LT(mean["normal_degrees"]["median"],
            0.1 * 180 / std::numbers::pi);  // less near the axis of the tilt
  EXPECT_GT(mean["normal_degrees"]["mean"], 2);
}

TEST_F(MapErrors, OfMissingPixelsAreThePenalty) {
  WriteSphere(workspace_, [&](int, SphereMaps& maps) {
    for (int y = 0; y < maps.depth.height(); ++y)
      for (int x = 0; x < 80; ++x) maps.depth(x, y) = 0;
  });
  const json mean = Mean();
  const double missing = 1 - mean["completeness"].get<double>();
  EXPECT_NEAR(missing, 0.5, 0.05);
  EXPECT_NEAR(mean["normal_degrees"]["over_all"]["mean"], 90 * missing, 0.1);
  EXPECT_NEAR(mean["depth"]["over_all"]["mean"], 0.05 * missing, 3e-4);
}

TEST_F(MapErrors, AreGivenPixelByPixelAndAsACurve) {
  WriteSphere(workspace_, [](int, SphereMaps& maps) {
    for (float& depth : maps.depth.pixels())
      if (depth > 0) depth += 0.015f;
    for (int x = 0; x < 80; ++x) maps.depth(x, 60) = 0;
  });
  Progress progress;
  std::vector<std::string> views;
  const json report = EvaluateMaps(workspace_, {}, truth_, {}, progress,
                                   [&](const std::string& view, const ErrorMaps& errors) {
                                     views.push_back(view);
                                     EXPECT_TRUE(std::isnan(errors.depth(0, 0)));    // beside the sphere
                                     EXPECT_TRUE(std::isinf(errors.depth(70, 60)));  // missing
                                     EXPECT_NEAR(errors.depth(90, 60), 0.015, 2e-4);
                                     EXPECT_LT(errors.normal_deg(90, 60), 0.5);
                                   });
  EXPECT_EQ(views, (std::vector<std::string>{"v100", "v101", "v102"}));
  const json& curve = report["curves"]["depth"];
  EXPECT_EQ(curve["end"], 0.02);
  EXPECT_LT(curve["shares"][74], 0.02);  // below 0.0148
  EXPECT_NEAR(curve["shares"][76], report["mean"]["completeness"], 0.02);
}

TEST_F(MapErrors, DoNotChangeWithTheFrameOfTheScan) {
  WriteSphere(workspace_);
  const json before = Mean();
  const Similarity truth_from_scan =
      SomeSimilarity();  // the truth lies elsewhere and is larger than the scan
  TriangleMesh mesh = SphereMesh(300);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    mesh.vertices[i] = truth_from_scan * mesh.vertices[i];
    mesh.normals[i] = truth_from_scan.rotation * mesh.normals[i];
  }
  EvaluateOptions options;
  options.unit = truth_from_scan.scale;
  const json after = Mean(truth_from_scan, Truth(mesh, {}), options);
  EXPECT_NEAR(after["depth"]["mean"], 2.5 * before["depth"]["mean"].get<double>(), 1e-6);
  EXPECT_NEAR(after["normal_degrees"]["mean"], before["normal_degrees"]["mean"], 1e-4);
  EXPECT_NEAR(after["completeness"], before["completeness"], 1e-9);
}

TEST_F(MapErrors, LeaveOutWhatTheTableHides) {
  WriteSphere(workspace_);
  Progress progress;
  const json alone = EvaluateMaps(workspace_, {}, truth_, {}, progress).at("per_view").at("v100");
  // A screen between the first camera and the lower half of the sphere.
  TriangleMesh screen;
  const Rigid world_from_cam = workspace_.views[0].cam_from_world.Inverse();
  for (const Eigen::Vector3d& corner : {Eigen::Vector3d(-5, 0, 2), {5, 0, 2}, {5, 5, 2}, {-5, 5, 2}})
    screen.vertices.push_back(world_from_cam * corner);
  screen.triangles = {{0, 1, 2}, {0, 2, 3}};
  ComputeVertexNormals(screen);
  const Truth hidden(SphereMesh(300), {screen});
  const json half = EvaluateMaps(workspace_, {}, hidden, {}, progress).at("per_view").at("v100");
  EXPECT_NEAR(half["object_pixels"].get<double>() / alone["object_pixels"].get<double>(), 0.5, 0.02);
  EXPECT_NEAR(half["beyond"], 0.5, 0.02);
}

}  // namespace
}  // namespace polarscan
