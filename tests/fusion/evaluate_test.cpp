// SPDX-License-Identifier: Apache-2.0
#include "evaluation/evaluate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/files/files.h"
#include "evaluation/error_statistics.h"
#include "evaluation/thresholds.h"
#include "tests/fusion/similarity.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {
namespace {

// Points of a square grid in the plane z = height.
std::vector<Eigen::Vector3d> Grid(double from_x, double to_x, double half_y, double spacing, double height) {
  std::vector<Eigen::Vector3d> points;
  for (double x = from_x; x <= to_x + 1e-9; x += spacing)
    for (double y = -half_y; y <= half_y + 1e-9; y += spacing) points.emplace_back(x, y, height);
  return points;
}

CloudEvaluation EvaluatePoints(const std::vector<Eigen::Vector3d>& points, const Truth& truth,
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
  const PixelErrors r = SumUpPixels({0.01, 0.03, 0.2}, 5, 0.05, {0.02, 0.1}).value();
  EXPECT_DOUBLE_EQ(*r.estimated.mean, 0.08);
  EXPECT_DOUBLE_EQ(*r.estimated.median, 0.03);
  EXPECT_DOUBLE_EQ(*r.all.mean, (0.01 + 0.03 + 3 * 0.05) / 5);
  EXPECT_DOUBLE_EQ(*r.all.median, 0.05);
  EXPECT_DOUBLE_EQ(r.estimated.within.at(0.02), 1 / 3.);
  EXPECT_DOUBLE_EQ(r.all.within.at(0.1), 0.4);
}

TEST(Statistics, TheCurveOfEvenlySpacedErrorsIsALine) {
  std::vector<double> errors;
  for (int i = 0; i < 1000; ++i) errors.push_back((i + 0.5) / 1000);
  ErrorCurve curve(0.5);
  curve.Add(errors);
  const Curve whole = curve.Shares().value();
  EXPECT_EQ(whole.end, 0.5);
  ASSERT_EQ(whole.shares.size(), 101u);
  for (std::size_t i = 0; i <= 100; ++i) EXPECT_NEAR(whole.shares[i], 0.005 * double(i), 1e-12);
  curve.AddMissing(1000);
  EXPECT_NEAR(curve.Shares().value().shares[100], 0.25, 1e-12);
  EXPECT_FALSE(ErrorCurve(1).Shares());
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
  const CloudEvaluation r = EvaluatePoints(Grid(-0.9, 0.9, 0.9, 0.01, 0.0125), truth, options);
  EXPECT_NEAR(r.accuracy->mean, 0.0125, 1e-9);
  EXPECT_NEAR(r.accuracy->p90, 0.0125, 1e-9);
  EXPECT_DOUBLE_EQ(r.within.at(0.01).precision, 0);
  EXPECT_DOUBLE_EQ(r.within.at(0.02).precision, 1);
  EXPECT_NEAR(r.completeness->median, std::hypot(0.0125, 0.0038),
              5e-4);  // 0.0038: half of a 0.01 cell is nearer
}

TEST(Cloud, HalfOfASurfaceHasHalfOfTheRecall) {
  const Truth truth(SquareMesh(1, 0), {});
  EvaluateOptions options;
  options.unit = 1;
  options.cap = 0.1;
  const CloudEvaluation r = EvaluatePoints(Grid(-1, 0, 1, 0.01, 0), truth, options);
  EXPECT_NEAR(r.within.at(0.01).recall, 0.505, 0.006);
  EXPECT_DOUBLE_EQ(r.within.at(0.01).precision, 1);
  EXPECT_NEAR(r.within.at(0.01).f, 2 * 0.505 / 1.505, 0.006);
  EXPECT_NEAR(r.completeness->mean, (0.5 * 0.0038 + 0.05 * 0.05 + 0.45 * 0.1),
              0.001);  // capped beyond 0.1
}

TEST(Cloud, PointsOfTheTableDoNotCountAndStraysDo) {
  const std::vector<Eigen::Vector3d> object = Grid(-0.9, 0.9, 0.9, 0.02, 0.001);
  std::vector<Eigen::Vector3d> points = object;
  for (const Eigen::Vector3d& p : Grid(-2, 2, 2, 0.05, -0.9)) points.push_back(p);
  points.emplace_back(0, 0, 0.5);  // a stray above the object
  const Truth alone(SquareMesh(1, 0), {}), on_table(SquareMesh(1, 0), {SquareMesh(3, -1)});
  EXPECT_GT(EvaluatePoints(points, alone).accuracy->p90, 0.5);
  const CloudEvaluation r = EvaluatePoints(points, on_table);
  EXPECT_EQ(r.points_of_surroundings, points.size() - object.size() - 1);
  EXPECT_NEAR(r.accuracy->mean, (0.001 * double(object.size()) + 0.5) / double(object.size() + 1), 1e-9);

  EvaluateOptions options;
  options.crop = 0.1;
  const CloudEvaluation cropped = EvaluatePoints(points, alone, options);
  EXPECT_EQ(cropped.points_cropped, points.size() - object.size());
  EXPECT_NEAR(cropped.accuracy->mean, 0.001, 1e-9);
}

TEST(Cloud, OnlySurfaceThatCamerasSeeCounts) {
  const Truth truth(SphereMesh(100), {});
  std::vector<DenseView> cameras = {
      {"one", {200, 200, 150, 150, 100, 100}, LookAtOrigin({0, 0, 4}), 1, 9, {}}};
  EvaluateOptions options;
  options.seen_by = 1;
  const std::vector<Eigen::Vector3d> points = SphereMesh(50).vertices;
  // The cap that is seen from distance 4 is (1 - 1/4) / 2 of the sphere.
  EXPECT_NEAR(EvaluatePoints(points, truth, options, cameras).visible_share, 0.375, 0.005);
  cameras.push_back({"two", cameras[0].camera, LookAtOrigin({0, 0, -4}), 1, 9, {}});
  EXPECT_NEAR(EvaluatePoints(points, truth, options, cameras).visible_share, 0.75, 0.005);
  options.seen_by = 2;
  EXPECT_NEAR(EvaluatePoints(points, truth, options, cameras).visible_share, 0, 1e-9);
  options.seen_by = 0;
  EXPECT_NEAR(EvaluatePoints(points, truth, options, cameras).visible_share, 1, 1e-9);
  options.seen_by = 1;  // a screen before the first camera
  const Truth hidden(SphereMesh(100), {SquareMesh(2, 2)});
  EXPECT_NEAR(EvaluatePoints(points, hidden, options, cameras).visible_share, 0.375, 0.005);
}

TEST(Cloud, NothingLeftToCompareIsAnError) {
  const Truth truth(SquareMesh(1, 0), {SquareMesh(1, -5)});
  EXPECT_THROW(EvaluatePoints({{0, 0, -4.9}}, truth), Error);
}

class ErrorsOfMaps : public ::testing::Test {
 protected:
  MapErrors Mean() { return Mean({}, truth_, {}); }
  MapErrors Mean(const Similarity& truth_from_scan, const Truth& truth, const EvaluateOptions& options) {
    Progress progress;
    return EvaluateMaps(workspace_, truth_from_scan, truth, options, progress).mean;
  }

  TemporaryFolder folder_;
  Workspace workspace_ = SphereWorkspace(folder_.path(), 3);
  Truth truth_{SphereMesh(300), {}};
};

TEST_F(ErrorsOfMaps, AreNearlyZeroForExactMaps) {
  WriteSphere(workspace_);
  const MapErrors mean = Mean();
  EXPECT_LT(mean.depth->estimated.median.value(), 1e-4);
  EXPECT_LT(mean.normal_deg->estimated.median.value(), 0.03);
  EXPECT_GT(mean.completeness, 0.995);
  EXPECT_LT(mean.beyond, 0.005);
}

TEST_F(ErrorsOfMaps, AreTheOffsetAndTheTiltThatWerePutIn) {
  const Eigen::AngleAxisf tilt(0.1f, Eigen::Vector3f::UnitZ());
  WriteSphere(workspace_, [&](int, SphereMaps& maps) {
    for (float& depth : maps.depth.pixels())
      if (depth > 0) depth += 0.015f;
    for (Eigen::Vector3f& n : maps.normal.pixels()) n = 3 * (tilt * n);  // its length does not matter
  });
  const MapErrors mean = Mean();
  EXPECT_NEAR(mean.depth->estimated.median.value(), 0.015, 1e-4);
  EXPECT_LT(mean.depth->estimated.within.at(0.01), 0.02);
  EXPECT_GT(mean.depth->estimated.within.at(0.02), 0.98);
  EXPECT_LT(mean.normal_deg->estimated.median.value(),
            0.1 * 180 / std::numbers::pi);  // less near the axis of the tilt
  EXPECT_GT(mean.normal_deg->estimated.mean.value(), 2);
}

TEST_F(ErrorsOfMaps, OfMissingPixelsAreThePenalty) {
  WriteSphere(workspace_, [&](int, SphereMaps& maps) {
    for (int y = 0; y < maps.depth.height(); ++y)
      for (int x = 0; x < 80; ++x) maps.depth(x, y) = 0;
  });
  const MapErrors mean = Mean();
  const double missing = 1 - mean.completeness;
  EXPECT_NEAR(missing, 0.5, 0.05);
  EXPECT_NEAR(mean.normal_deg->all.mean.value(), 90 * missing, 0.1);
  EXPECT_NEAR(mean.depth->all.mean.value(), 0.05 * missing, 3e-4);
}

TEST_F(ErrorsOfMaps, AreGivenPixelByPixelAndAsACurve) {
  WriteSphere(workspace_, [](int, SphereMaps& maps) {
    for (float& depth : maps.depth.pixels())
      if (depth > 0) depth += 0.015f;
    for (int x = 0; x < 80; ++x) maps.depth(x, 60) = 0;
  });
  Progress progress;
  std::vector<std::string> views;
  const MapsEvaluation report = EvaluateMaps(
      workspace_, {}, truth_, {}, progress, [&](const std::string& view, const ErrorMaps& errors) {
        views.push_back(view);
        EXPECT_TRUE(std::isnan(errors.depth(0, 0)));    // beside the sphere
        EXPECT_TRUE(std::isinf(errors.depth(70, 60)));  // missing
        EXPECT_NEAR(errors.depth(90, 60), 0.015, 2e-4);
        EXPECT_LT(errors.normal_deg(90, 60), 0.5);
      });
  EXPECT_EQ(views, (std::vector<std::string>{"v100", "v101", "v102"}));
  const Curve curve = report.depth.value();
  EXPECT_EQ(curve.end, 0.02);
  EXPECT_LT(curve.shares[74], 0.02);  // below 0.0148
  EXPECT_NEAR(curve.shares[76], report.mean.completeness, 0.02);
}

TEST_F(ErrorsOfMaps, OfAViewWithoutNormalsAndOfOneWithoutTheObjectDoNotStandInTheMean) {
  WriteSphere(workspace_);
  std::filesystem::remove(workspace_.NormalPath(0, kFinalMaps));
  workspace_.views[1].cam_from_world.translation.x() += 100;  // the object is out of the picture
  Progress progress;
  const MapsEvaluation maps = EvaluateMaps(workspace_, {}, truth_, {}, progress);
  EXPECT_FALSE(maps.per_view.at("v100").normal_deg);
  EXPECT_FALSE(maps.per_view.at("v101").depth);
  EXPECT_EQ(*maps.mean.depth->all.mean,
            (*maps.per_view.at("v100").depth->all.mean + *maps.per_view.at("v102").depth->all.mean) / 2);
  EXPECT_EQ(*maps.mean.normal_deg->all.mean, *maps.per_view.at("v102").normal_deg->all.mean);
}

TEST_F(ErrorsOfMaps, AndOfCloudsAreReadAsTheyWereWritten) {
  WriteSphere(workspace_);
  Progress progress;
  Evaluation evaluation;
  evaluation.input = "scan", evaluation.truth = "mesh.ply";
  evaluation.maps_result = "digest", evaluation.cloud_hash = "hash";
  evaluation.alignment = AlignmentErrors{3, 2.5, 0.25, 0.5, 1, "v100"};
  evaluation.pictures = ErrorLimits{0.02, 30};
  std::filesystem::remove(workspace_.NormalPath(0, kFinalMaps));
  evaluation.maps = EvaluateMaps(workspace_, {}, truth_, {}, progress);
  evaluation.cloud = EvaluatePoints(Grid(-1, 0, 1, 0.01, 0), truth_);
  const std::filesystem::path file = folder_.path() / "evaluation.json";
  WriteJson(file, ToJson(evaluation));
  EXPECT_EQ(ToJson(ReadEvaluation(file)), ToJson(evaluation));
  WriteJson(file, {{"input", "scan"}});
  EXPECT_THROW(ReadEvaluation(file), Error);
}

TEST_F(ErrorsOfMaps, DoNotChangeWithTheFrameOfTheScan) {
  WriteSphere(workspace_);
  const MapErrors before = Mean();
  const Similarity truth_from_scan =
      SomeSimilarity();  // the truth lies elsewhere and is larger than the scan
  TriangleMesh mesh = SphereMesh(300);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    mesh.vertices[i] = truth_from_scan * mesh.vertices[i];
    mesh.normals[i] = truth_from_scan.rotation * mesh.normals[i];
  }
  EvaluateOptions options;
  options.unit = truth_from_scan.scale;
  const MapErrors after = Mean(truth_from_scan, Truth(mesh, {}), options);
  EXPECT_NEAR(after.depth->estimated.mean.value(), 2.5 * before.depth->estimated.mean.value(), 1e-6);
  EXPECT_NEAR(after.normal_deg->estimated.mean.value(), before.normal_deg->estimated.mean.value(), 1e-4);
  EXPECT_NEAR(after.completeness, before.completeness, 1e-9);
}

TEST_F(ErrorsOfMaps, LeaveOutWhatTheTableHides) {
  WriteSphere(workspace_);
  Progress progress;
  const MapErrors alone = EvaluateMaps(workspace_, {}, truth_, {}, progress).per_view.at("v100");
  // A screen between the first camera and the lower half of the sphere.
  TriangleMesh screen;
  const Rigid world_from_cam = workspace_.views[0].cam_from_world.Inverse();
  for (const Eigen::Vector3d& corner : {Eigen::Vector3d(-5, 0, 2), {5, 0, 2}, {5, 5, 2}, {-5, 5, 2}})
    screen.vertices.push_back(world_from_cam * corner);
  screen.triangles = {{0, 1, 2}, {0, 2, 3}};
  ComputeVertexNormals(screen);
  const Truth hidden(SphereMesh(300), {screen});
  const MapErrors half = EvaluateMaps(workspace_, {}, hidden, {}, progress).per_view.at("v100");
  EXPECT_NEAR(half.object_pixels / alone.object_pixels, 0.5, 0.02);
  EXPECT_NEAR(half.beyond, 0.5, 0.02);
}

}  // namespace
}  // namespace polarscan
