// SPDX-License-Identifier: Apache-2.0
// Fusion against COLMAP's own, and evaluation against the independent programs in tools/.
#include <gtest/gtest.h>

#include "core/files/process.h"
#include "core/random.h"
#include "evaluation/evaluate.h"
#include "fusion/cloud/cloud.h"
#include "fusion/cloud/fuse.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

bool Runs(const std::vector<std::string>& argv, const fs::path& log) {
  Progress progress;
  return RunProcess(argv, log, progress).exit_code == 0;
}

// Points of the sphere that the views see, with tracks: COLMAP's fusion finds overlapping views by them.
void AddSparsePoints(SparseModel& model, const Workspace& workspace) {
  Random random(1);
  for (std::uint64_t id = 1; id <= 400; ++id) {
    ColmapPoint point;
    point.position = Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
    for (std::size_t i = 0; i < workspace.views.size(); ++i) {
      const DenseView& view = workspace.views[i];
      if ((view.cam_from_world.Center() - point.position).dot(point.position) <= 0) continue;
      ColmapImage& image = model.images[std::uint32_t(i + 1)];
      const Eigen::Vector2d uv = view.camera.Project(view.cam_from_world * point.position);
      point.track.push_back({image.id, std::uint32_t(image.observations.size())});
      image.observations.push_back({uv.x(), uv.y(), std::int64_t(id)});
    }
    if (point.track.size() >= 2) model.points[id] = point;
  }
}

struct SphereFit {
  std::size_t points = 0;
  double rms = 0;
};

SphereFit FitSphere(const fs::path& cloud) {
  const auto positions = ReadCloudPositions(cloud).points;
  SphereFit fit{positions.size()};
  for (const Eigen::Vector3d& p : positions) fit.rms += std::pow(p.norm() - 1, 2) / double(fit.points);
  fit.rms = std::sqrt(fit.rms);
  return fit;
}

// As the program prints it.
json Printed(const MapsEvaluation& maps) {
  Evaluation evaluation;
  evaluation.maps = maps;
  return ToJson(evaluation).at("maps");
}
json Printed(const CloudEvaluation& cloud) {
  Evaluation evaluation;
  evaluation.cloud = cloud;
  return ToJson(evaluation).at("cloud");
}

CloudEvaluation Compare(const fs::path& cloud) {
  Progress progress;
  EvaluateOptions options;
  options.samples = 20000;
  options.cloud_thresholds = "0.05";
  return EvaluateCloud(ReadCloudPositions(cloud).points, {}, Truth(SphereMesh(200), {}), options, 1,
                       progress);
}

// Maps, pictures and cameras are in COLMAP's layout; its cameras count pixels from 0, ours are at + 0.5, so
// the exported principal points are shifted (docs/conventions.md). Without the shift COLMAP's cloud is off
// the sphere (last lines).
TEST(Agreement, ColmapsOwnFusionGivesASimilarCloudFromOurWorkspace) {
  const fs::path colmap = FindProgram("colmap");
  if (colmap.empty()) GTEST_SKIP() << "colmap is not installed";
  TemporaryFolder folder;
  const Workspace workspace = SphereWorkspace(folder.path(), 8);
  WriteSphere(workspace);
  std::string names;
  for (const DenseView& view : workspace.views) names += view.name + ".png\n";
  WriteFileAtomically(folder.path() / "stereo/fusion.cfg", names);
  const auto fuse_by_colmap = [&](double shift, const std::string& output) {
    SparseModel model = ToModel(workspace, shift);
    AddSparsePoints(model, workspace);
    fs::remove_all(folder.path() / "sparse");
    CreateFolder(folder.path() / "sparse");
    WriteSparseModelBinary(folder.path() / "sparse", model);
    const fs::path cloud = folder.path() / output;
    EXPECT_TRUE(Runs({colmap, "stereo_fusion", "--workspace_path", folder.path(), "--output_path", cloud,
                      "--StereoFusion.min_num_pixels", "3", "--StereoFusion.max_normal_error", "30"},
                     folder.path() / "log"))
        << ReadFile(folder.path() / "log");
    return cloud;
  };
  const fs::path theirs = fuse_by_colmap(-0.5, "colmap.ply"), ours = folder.path() / "ours.ply";
  Progress progress;
  FusionOptions options;  // the same limits as COLMAP's
  options.reprojection_px = 2;
  options.normal_deg = 30;
  FuseCloud(workspace, ours, options, progress);
  const SphereFit a = FitSphere(ours), b = FitSphere(theirs),
                  unshifted = FitSphere(fuse_by_colmap(0, "trap.ply"));
  EXPECT_LT(a.rms, 5e-4);
  EXPECT_LT(b.rms, 2e-3);  // it takes medians of positions that are not on one ray
  EXPECT_GT(a.points, b.points);
  EXPECT_LT(a.points, 5 * b.points);  // its walk also merges neighbours in one view
  const double our_recall = Compare(ours).within.at(0.05).recall;
  const double their_recall = Compare(theirs).within.at(0.05).recall;
  EXPECT_NEAR(our_recall, their_recall,
              0.05);  // spacing: about 0.025
  EXPECT_GT(unshifted.rms, 2 * b.rms);
}

class Scripts : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* chosen = std::getenv("POLARSCAN_PYTHON");
    python_ = FindProgram(chosen ? chosen : "/usr/bin/python3");
    if (python_.empty() || !Runs({python_, "-c", "import numpy, scipy"}, folder_.path() / "log"))
      GTEST_SKIP() << "no Python with numpy and scipy (POLARSCAN_PYTHON names another)";
  }

  json Run(std::vector<std::string> arguments) {
    const fs::path out = folder_.path() / "out.json", log = folder_.path() / "log";
    arguments[0] = tools_ / arguments[0];
    arguments.insert(arguments.begin(), python_);
    arguments.insert(arguments.end(), {"--out", out});
    EXPECT_TRUE(Runs(arguments, log)) << ReadFile(log);
    return ReadJson(out);
  }

  TemporaryFolder folder_;
  fs::path tools_ = fs::path(POLARSCAN_SOURCE) / "tools", python_;
};

// Every number of `theirs` is in `ours`, and nearly the same.
void ExpectSameNumbers(const json& theirs, const json& ours, double tolerance, const std::string& where) {
  if (theirs.is_object()) {
    for (const auto& [key, value] : theirs.items()) {
      ASSERT_TRUE(ours.contains(key)) << where << "/" << key;
      ExpectSameNumbers(value, ours.at(key), tolerance, where + "/" + key);
    }
  } else if (theirs.is_number()) {
    EXPECT_NEAR(theirs.get<double>(), ours.get<double>(), tolerance * (1 + std::abs(theirs.get<double>())))
        << where;
  }
}

TEST_F(Scripts, OfMapsFindTheSameErrors) {
  const Workspace workspace = SphereWorkspace(folder_.path(), 3);
  WriteSphere(workspace, [](int view, SphereMaps& maps) {
    Random random(5, std::uint64_t(view));
    for (std::size_t i = 0; i < maps.depth.size(); ++i) {
      float& depth = maps.depth.pixels()[i];
      depth = random.Uniform() < 0.1   ? 3.f
              : random.Uniform() < 0.2 ? 0.f
                                       : depth + float(0.01 * random.Normal());
      maps.normal.pixels()[i] += Eigen::Vector3f(0.2f, 0, 0) * float(random.Normal());
      if (random.Uniform() < 0.02) maps.normal.pixels()[i].setZero();
    }
  });
  const TriangleMesh mesh = SphereMesh(80);
  WriteMesh(folder_.path() / "mesh.ply", mesh);
  CreateFolder(folder_.path() / "sparse");
  WriteSparseModelText(folder_.path() / "sparse", ToModel(workspace, 0));
  const json theirs =
      Run({"eval_maps.py", folder_.path(), folder_.path() / "sparse", folder_.path() / "mesh.ply"});
  Progress progress;
  const json ours = Printed(EvaluateMaps(workspace, {}, Truth(ReadMesh(folder_.path() / "mesh.ply"), {}),
                                         EvaluateOptions(), progress));
  EXPECT_EQ(theirs["views"], ours["views"]);
  EXPECT_EQ(theirs["per_view"]["v101.png"]["object_pixels"], ours["per_view"]["v101"]["object_pixels"]);
  ExpectSameNumbers(theirs["mean"], ours["mean"], 1e-5, "mean");  // they round to five digits
}

TEST_F(Scripts, OfCloudsFindTheSameDistances) {
  Random random(9);
  std::vector<CloudPoint> points(20000);
  for (CloudPoint& p : points) {
    Eigen::Vector3d n(random.Normal(), random.Normal(), random.Normal());
    n.normalize();
    if (n.z() < 0) n.x() = std::abs(n.x());  // a quarter is missing
    p.position = ((1 + 0.004 * random.Normal()) * n).cast<float>();
  }
  const Workspace workspace = SphereWorkspace(folder_.path(), 6);
  CreateFolder(folder_.path() / "sparse");
  WriteSparseModelText(folder_.path() / "sparse", ToModel(workspace, 0));
  WriteCloud(folder_.path() / "cloud.ply", points);
  WriteMesh(folder_.path() / "mesh.ply", SphereMesh(80));
  EvaluateOptions options;
  options.cap = 0.1;
  options.samples = 200000;
  Progress progress;
  const Truth truth(ReadMesh(folder_.path() / "mesh.ply"), {});
  const auto positions = ReadCloudPositions(folder_.path() / "cloud.ply").points;
  std::vector<std::string> arguments = {"eval_cloud.py",
                                        folder_.path() / "cloud.ply",
                                        folder_.path() / "mesh.ply",
                                        "--exact",
                                        "--cap",
                                        "0.1",
                                        "--samples",
                                        "200000"};
  json theirs = Run(arguments);
  json ours = Printed(EvaluateCloud(positions, {}, truth, options, 1, progress));
  ExpectSameNumbers(theirs["accuracy"], ours["accuracy"], 1e-5, "accuracy");  // they round to six digits
  ExpectSameNumbers(theirs["completeness"], ours["completeness"], 5e-4,
                    "completeness");  // other random samples
  ExpectSameNumbers(theirs["thresholds"], ours["thresholds"], 0.005, "thresholds");
  EXPECT_NEAR(theirs["area"], ours["area"], 1e-5);

  arguments.insert(arguments.end(), {"--visible-from", folder_.path() / "sparse"});
  theirs = Run(arguments);
  ours = Printed(EvaluateCloud(positions, workspace.views, truth, options, 1, progress));
  EXPECT_NEAR(theirs["visible_share"], ours["visible_share"], 0.005);
  ExpectSameNumbers(theirs["completeness"], ours["completeness"], 5e-4, "visible completeness");
}

}  // namespace
}  // namespace polarscan
