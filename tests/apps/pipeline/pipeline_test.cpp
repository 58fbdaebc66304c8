// SPDX-License-Identifier: Apache-2.0
// The whole program on a small simulated set with known poses: what it makes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <set>

#include "core/files/files.h"
#include "core/formats/ply.h"
#include "core/mesh.h"
#include "core/random.h"
#include "pipeline/pipeline_scan.h"
#include "stereo/sfm/alignment.h"
#include "stereo/sfm/model/model.h"
#include "toy_scan.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

TEST_F(Pipeline, SaysWhatItDidInScanJson) {
  const fs::path scan = Folder("scan");
  const Outcome outcome = RunPolarscan(Command(scan, {"--json"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;

  EXPECT_EQ(outcome.err.find('\x1b'), std::string::npos) << "escape codes in a file";

  const json state = json::parse(outcome.out);
  EXPECT_EQ(state, ReadJson(scan / "scan.json"));
  EXPECT_EQ(state["views"]["total"], 8);
  EXPECT_EQ(state["views"]["registered"], 8);
  EXPECT_EQ(state["views"]["polarized"], true);
  EXPECT_GT(state["cloud"]["points"], 300);
  EXPECT_GT(state["mesh"]["faces"], 300);
  for (const char* stage : {"views", "sfm", "dense", "stereo", "fusion", "mesh", "report"})
    EXPECT_EQ(state["stages"][stage]["state"], "done") << stage;
  EXPECT_EQ(state["options"]["stereo"]["photometric-iterations"], 1);
  EXPECT_TRUE(fs::exists(scan / "report.html"));
  EXPECT_TRUE(fs::exists(scan / "dense/polar/000000.tif"));
}

TEST_F(Pipeline, NeedsNoNetworkNoDisplayAndNoHome) {
  if (Process({"unshare", "--net", "true"}).Wait().exit_code != 0)
    GTEST_SKIP() << "a process without network may not be made here";
  const fs::path scan = Folder("scan");
  std::vector<std::string> command = Polarscan(Command(scan));
  const std::vector<std::string> without = {
      "unshare", "--net",          "env",       "-u", "DISPLAY", "-u", "WAYLAND_DISPLAY",
      "-u",      "XDG_CACHE_HOME", "HOME=/proc"};
  command.insert(command.begin(), without.begin(), without.end());
  const Outcome outcome = Process(command).Wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(fs::exists(scan / "mesh.ply"));
}

// The bounds leave room around what is expected at this size, where a pixel is 0.02 wide, and are far from
// chance: a random normal is off by 57 degrees, a random depth inside the ball by 0.3.
TEST_F(Pipeline, MakesACloudNearTheTruth) {
  ASSERT_EQ(Simulate(Folder("ball.ply"), Folder("input"), "30:12", 112, 96).exit_code, 0);
  const std::vector<std::string> command = {"reconstruct",
                                            Folder("input").string(),
                                            "-o",
                                            Folder("scan").string(),
                                            "--photometric-iterations",
                                            "2",
                                            "--geometric-iterations",
                                            "1",
                                            "--window-radius",
                                            "3",
                                            "--samples",
                                            "6",
                                            "--sources",
                                            "4"};
  const Outcome outcome = RunPolarscan(command);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;

  const Outcome evaluation = RunPolarscan({"evaluate", Folder("scan").string(), "--truth",
                                           (Folder("input") / "truth/mesh.ply").string(), "--json"});
  ASSERT_EQ(evaluation.exit_code, 0) << evaluation.err;
  const json errors = json::parse(evaluation.out);
  EXPECT_LT(errors.at("cloud").at("accuracy").at("mean"), 0.02);
  EXPECT_GT(errors.at("cloud").at("thresholds").at("0.02").at("precision"), 0.7);
  EXPECT_GT(errors.at("cloud").at("thresholds").at("0.02").at("recall"), 0.3);
  EXPECT_LT(errors.at("maps").at("mean").at("depth").at("median"), 0.02);
  EXPECT_LT(errors.at("maps").at("mean").at("normal_degrees").at("median"), 25.0);
}

TEST_F(Pipeline, OneThreadAndTwoThreadsGiveTheSameBytes) {
  ASSERT_EQ(RunPolarscan(Command(Folder("one"), {"--threads", "1"})).exit_code, 0);
  ASSERT_EQ(RunPolarscan(Command(Folder("two"), {"--threads", "2"})).exit_code, 0);
  ExpectSameResults(Folder("one"), Folder("two"));
}

TEST_F(Pipeline, AnotherSeedGivesOtherMaps) {
  ASSERT_EQ(RunPolarscan(Command(Folder("a"), {"--seed", "1"})).exit_code, 0);
  ASSERT_EQ(RunPolarscan(Command(Folder("b"), {"--seed", "2"})).exit_code, 0);
  EXPECT_FALSE(Results(Folder("a")) == Results(Folder("b")));
}

TEST_F(Pipeline, AStageOfAFolderThatIsNoScanIsRefused) {
  for (const char* stage : {"sfm", "stereo", "fuse", "mesh"}) {
    const Outcome outcome = RunPolarscan({stage, Input().string()});
    EXPECT_EQ(outcome.exit_code, 1) << stage;
    EXPECT_NE(outcome.err.find("polarscan reconstruct"), std::string::npos) << outcome.err;
  }
}

TEST_F(Pipeline, PhotosWithoutPolarizationReconstructAndTheMessageSaysSo) {
  const fs::path views = Folder("views"), photos = Folder("photos");
  ASSERT_EQ(RunPolarscan({"demosaic", Input().string(), "-o", views.string()}).exit_code, 0);
  fs::create_directory(photos);
  for (const fs::directory_entry& entry : fs::directory_iterator(views))
    if (entry.path().extension() == ".png") fs::copy(entry.path(), photos / entry.path().filename());
  fs::copy(Input() / "sparse", photos / "sparse", fs::copy_options::recursive);
  fs::copy(Input() / "masks", photos / "masks", fs::copy_options::recursive);

  const fs::path scan = Folder("scan");
  const Outcome outcome = RunPolarscan(Command(scan, {"--input-kind", "photos"}, photos));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("no polarization is known, so stereo goes by the intensity alone"),
            std::string::npos)
      << outcome.err;
  EXPECT_EQ(ReadJson(scan / "scan.json")["views"]["polarized"], false);
  EXPECT_GT(ReadJson(scan / "scan.json")["cloud"]["points"], 300);
}

TEST_F(Pipeline, PosesThatAreOnlyNearlyRightAreAdjustedToThePictures) {
  if (!HasProgram("colmap")) GTEST_SKIP() << "COLMAP is not installed";
  const fs::path input = Folder("input"), scan = Folder("scan");
  const Outcome pictures = RunPolarscan({"simulate", "-o", input.string(), "--masks", "--known-poses",
                                         "--width", "320", "--height", "272", "--rings", "45:8", "--samples",
                                         "1", "--texture", "strong", "--light", "overcast", "--fov", "50"});
  ASSERT_EQ(pictures.exit_code, kDone) << pictures.err;
  const SparseModel truth = ReadSparseModel(input / "sparse");
  SparseModel given = truth;
  Random random(5);
  const auto error = [&] { return Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()); };
  for (auto& [id, image] : given.images) {
    Rigid& pose = image.cam_from_world;
    const Eigen::Vector3d turn = 0.01 * error();
    pose.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * pose.rotation;
    pose.translation += 0.03 * error();
  }
  WriteSparseModelText(input / "sparse", given);
  const Outcome outcome = RunPolarscan(
      {"reconstruct", input.string(), "-o", scan.string(), "--bundle-adjustment", "--no-mesh", "--preset",
       "fast", "--levels", "1", "--surfaces", "0", "--max-image-size", "64", "--fusion-min-views", "2"});
  ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
  EXPECT_NE(outcome.err.find("bundle adjustment of"), std::string::npos) << outcome.err;
  const SparseModel adjusted = ReadSparseModel(scan / "sfm/model");
  ASSERT_EQ(adjusted.images.size(), 8u);
  const auto misplacement = [&](const SparseModel& model) {
    return AlignCameras(Poses(model), Poses(truth)).errors.rms;
  };
  EXPECT_LT(misplacement(adjusted), 0.5 * misplacement(given));
  for (const auto& [id, image] : adjusted.images)  // in the frame of what was given
    for (const auto& [given_id, other] : given.images) {
      const double moved = (image.cam_from_world.Center() - other.cam_from_world.Center()).norm();
      const bool is_same = fs::path(image.name).stem() == fs::path(other.name).stem();
      EXPECT_LT(is_same ? moved : 0, 0.15) << image.name;
    }
}

TEST_F(Pipeline, AConfigurationFileSetsOptionsAndTheCommandLineGoesBeforeIt) {
  const fs::path config = Folder("options.toml"), scan = Folder("scan");
  WriteFileAtomically(config, "[reconstruct]\nsigma-color = 0.3\nsamples = 7\n");
  ASSERT_EQ(RunPolarscan(Command(scan, {"--config", config.string(), "--samples", "5"})).exit_code, 0);
  const json options = ReadJson(scan / "scan.json")["options"]["stereo"];
  EXPECT_EQ(options["sigma-color"], 0.3);
  EXPECT_EQ(options["samples"], 5);

  WriteFileAtomically(config, "[reconstruct]\nsigma-colour = 0.3\n");
  EXPECT_EQ(RunPolarscan(Command(Folder("other"), {"--config", config.string()})).exit_code, 2);
}

TEST_F(Pipeline, APresetIsTakenWholeAndWhatElseIsGivenGoesOnTop) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan, {"--preset", "paper", "--no-polarization"})).exit_code, 0);
  const json options = ReadJson(scan / "scan.json")["options"]["stereo"];
  EXPECT_EQ(options["polarization-weight"], 4.0);
  EXPECT_EQ(options["closed-form-normals"], false);
  EXPECT_EQ(options["photometric-iterations"], 1);  // given
  EXPECT_EQ(options["polarization"], false);        // given
}

// A layout with 45 and 135 exchanged counts the angles the other way.
TEST_F(Pipeline, AWrongLayoutIsNamedWithItsCureAndARightOneIsNot) {
  ASSERT_EQ(Simulate(Folder("ball.ply"), Folder("input"), "30:16", 128, 112).exit_code, 0);
  for (const auto& [layout, cure] : {std::pair{"90 45 / 135 0", ""}, {"90 135 / 45 0", "90 45 / 135 0"}}) {
    const fs::path scan = Folder(*cure ? "wrong" : "right");
    const Outcome outcome = RunPolarscan({"reconstruct", Folder("input").string(), "-o", scan.string(),
                                          "--preset", "fast", "--no-mesh", "--layout", layout});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const json state = ReadJson(scan / "scan.json");
    const json angles = state.at(json::json_pointer("/stages/stereo/counts/angles"));
    EXPECT_EQ(angles.contains("corrected") || angles.at("wrong").get<bool>(), *cure != 0) << angles;
    const bool said = state.at("warnings").dump().find("do not fit the shape") != std::string::npos;
    EXPECT_EQ(said, *cure != 0);
    if (*cure) {
      EXPECT_NE(state.at("warnings").dump().find(cure), std::string::npos) << state.at("warnings");
    }
  }
}

TEST_F(Pipeline, PosesFarFrom0GiveTheSameCloudInALocalFrameWithItsOffset) {
  const Eigen::Vector3d far_off(500000, 5400000, 300);
  fs::copy(Input(), Folder("far"), fs::copy_options::recursive);
  SparseModel model = ReadSparseModel(Input() / "sparse");
  MoveOrigin(model, -far_off);
  model.offset = Eigen::Vector3d::Zero();
  fs::remove_all(Folder("far") / "sparse");
  WriteSparseModelText(Folder("far") / "sparse", model);
  const std::vector<std::string> more = {"--photometric-iterations", "2"};
  ASSERT_EQ(RunPolarscan(Command(Folder("near scan"), more)).exit_code, 0);
  const Outcome outcome = RunPolarscan(Command(Folder("far scan"), more, Folder("far")));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json state = ReadJson(Folder("far scan") / "scan.json");
  EXPECT_EQ(state.at("offset"), json({500000.0, 5400000.0, 300.0}));
  EXPECT_NE(state.at("warnings").dump().find("500000 5400000 300"), std::string::npos);
  EXPECT_FALSE(ReadJson(Folder("near scan") / "scan.json").contains("offset"));
  EXPECT_EQ(ReadFile(Folder("far scan") / "offset.txt"), "500000 5400000 300\n");
  EXPECT_EQ(ReadFile(Folder("far scan") / "dense/sparse/offset.txt"), "500000 5400000 300\n");
  EXPECT_EQ(ReadPlyOffset(Folder("far scan") / "mesh.ply"), far_off);
  PlyElement a = ReadPly(Folder("near scan") / "cloud.ply").at("vertex"),
             b = ReadPly(Folder("far scan") / "cloud.ply").at("vertex");
  EXPECT_NEAR(double(b.count), double(a.count), 0.02 * double(a.count));
  // The last digits of the poses differ, so a coarse search finds here and there another depth; single
  // precision would leave steps of 0.5.
  constexpr double kPixel = 0.05;
  for (const char* axis : {"x", "y", "z"}) {
    std::vector<double>&va = a.columns[axis], &vb = b.columns[axis];
    std::ranges::sort(va);
    std::ranges::sort(vb);
    for (const double q : {0.02, 0.25, 0.5, 0.75, 0.98})
      EXPECT_NEAR(va[std::size_t(q * double(va.size()))], vb[std::size_t(q * double(vb.size()))], kPixel)
          << axis;
    EXPECT_GT(std::set<double>(vb.begin(), vb.end()).size(), vb.size() * 9 / 10) << axis;
  }
  // The truth in the poses' coordinates, in double precision: the same errors as at 0.
  const TriangleMesh ball = Ball();
  const auto error = [&](const std::string& scan, const Eigen::Vector3d& shift) {
    std::string ply = fmt::format(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double "
        "z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        ball.vertices.size(), ball.triangles.size());
    for (const Eigen::Vector3d& v : ball.vertices)
      ply += fmt::format("{} {} {}\n", v.x() + shift.x(), v.y() + shift.y(), v.z() + shift.z());
    for (const auto& t : ball.triangles) ply += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
    WriteFileAtomically(Folder("truth.ply"), ply);
    const Outcome evaluated = RunPolarscan(
        {"--json", "evaluate", Folder(scan).string(), "--truth", Folder("truth.ply").string(), "--no-maps"});
    EXPECT_EQ(evaluated.exit_code, 0) << evaluated.err;
    return json::parse(evaluated.out).at("cloud").at("accuracy").at("median").get<double>();
  };
  const double here = error("near scan", {0, 0, 0}), there = error("far scan", far_off);
  EXPECT_LT(here, 0.1);
  EXPECT_NEAR(there, here, 0.1 * here);
}

}  // namespace
}  // namespace polarscan::test
