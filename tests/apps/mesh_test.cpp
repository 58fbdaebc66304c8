// SPDX-License-Identifier: Apache-2.0
// `polarscan mesh` from outside, on a scan made from closed forms.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "core/files/files.h"
#include "core/mesh.h"
#include "program.h"
#include "toy_scan.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

class MeshCommand : public testing::Test {
 protected:
  void SetUp() override { WriteToyScan(Scan(), 8); }
  fs::path Scan() const { return folder_ / "scan"; }
  Outcome Run(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"mesh", Scan().string()});
    return RunPolarscan(more);
  }
  TemporaryFolder folder_;
};

TEST_F(MeshCommand, MakesAMeshAndSaysSoInScanJson) {
  const Outcome outcome = Run({"--json"});
  ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
  const json result = json::parse(outcome.out), state = ReadJson(Scan() / "scan.json");
  EXPECT_GT(result["faces"], 1000);
  EXPECT_TRUE(result["refined"]);
  EXPECT_EQ(result["mesh"], (Scan() / "mesh.ply").string());
  EXPECT_EQ(state["mesh"]["faces"], result["faces"]);
  EXPECT_EQ(state["stages"]["mesh"]["state"], "done");
  EXPECT_EQ(state["options"]["mesh"]["refine-iterations"], 8);
  EXPECT_TRUE(fs::exists(Scan() / "mesh.ply"));
}

TEST_F(MeshCommand, AgainDoesNothingAndAnOutputNameWritesThatFormat) {
  ASSERT_EQ(Run({"--no-refine"}).exit_code, kDone);
  const auto time = fs::last_write_time(Scan() / "mesh.ply");
  const fs::path glb = folder_ / "m.glb";
  const Outcome outcome = Run({"--no-refine", "-o", glb.string()});
  ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
  EXPECT_NE(outcome.err.find("done before"), std::string::npos) << outcome.err;
  EXPECT_EQ(fs::last_write_time(Scan() / "mesh.ply"), time);
  EXPECT_EQ(ReadFile(glb).substr(0, 4), "glTF");
}

TEST_F(MeshCommand, InverseRenderingStartsFromAGivenMeshAndChangesIt) {
  ASSERT_EQ(Run({"--no-refine", "-o", (folder_ / "start.ply").string()}).exit_code, kDone);
  const std::vector<std::string> mvir{"--mesh-from",     (folder_ / "start.ply").string(),
                                      "--mesh-edge",     "0",
                                      "--refine-method", "mvir",
                                      "--mvir-rounds",   "1",
                                      "--json"};
  const Outcome outcome = Run(mvir);
  ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
  const json result = json::parse(outcome.out), refinement = result["refinement"];
  const TriangleMesh before = ReadMesh(folder_ / "start.ply"), after = ReadMesh(Scan() / "mesh.ply");
  EXPECT_TRUE(before.triangles == after.triangles);
  EXPECT_FALSE(before.vertices == after.vertices);
  EXPECT_EQ(refinement["method"], "mvir");
  EXPECT_GT(refinement["mean_move"], 0);
  EXPECT_LT(refinement["cost_after"], refinement["cost_before"]);
  EXPECT_NE(Run(mvir).err.find("done before"), std::string::npos);
}

TEST_F(MeshCommand, FewerTrianglesThanItsTopologyAllowsAreSaidToBeMore) {
  const Outcome outcome = Run({"--no-refine", "--faces", "1", "--json"});
  ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
  const std::string words =
      fmt::format("{} triangles instead of 1", json::parse(outcome.out)["faces"].get<int>());
  EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  EXPECT_EQ(Run({"--no-refine", "--faces", "500"}).err.find("triangles instead of"), std::string::npos);
}

TEST_F(MeshCommand, AnStlComesWithAWordOnItsUnitAndIsATruth) {
  const std::string stl = (folder_ / "m.stl").string(), obj = (folder_ / "m.obj").string();
  const Outcome outcome = Run({"--no-refine", "-o", stl});
  ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
  EXPECT_NE(outcome.err.find("millimetres"), std::string::npos) << outcome.err;
  ASSERT_EQ(Run({"--no-refine", "-o", obj}).exit_code, kDone);
  std::vector<double> accuracy;
  for (const std::string& truth : {(Scan() / "mesh.ply").string(), stl, obj}) {
    const Outcome evaluated =
        RunPolarscan({"evaluate", (Scan() / "cloud.ply").string(), "--truth", truth, "--json"});
    ASSERT_EQ(evaluated.exit_code, kDone) << evaluated.err;
    accuracy.push_back(json::parse(evaluated.out)["cloud"]["accuracy"]["mean"]);
  }
  EXPECT_NEAR(accuracy[1], accuracy[0], 1e-6);
  EXPECT_NEAR(accuracy[2], accuracy[0], 1e-6);
}

TEST_F(MeshCommand, WritesOverItsOwnFilesAndNoOthers) {
  ASSERT_EQ(Run({"--no-refine"}).exit_code, kDone);
  for (const char* name : {"m.ply", "m.obj", "m.glb"})
    for (int again = 0; again < 2; ++again)
      EXPECT_EQ(Run({"--no-refine", "-o", (folder_ / name).string()}).exit_code, kDone) << name;
  WriteFileAtomically(folder_ / "thesis.obj", "v 0 0 0\n");
  fs::create_directory(folder_ / "other");
  fs::copy_file(Scan() / "mesh.ply", folder_ / "other/mesh.ply");
  WriteFileAtomically(folder_ / "other/scan.json", "{}");
  for (const fs::path& file : {Scan() / "cloud.ply", folder_ / "thesis.obj", folder_ / "other/mesh.ply"}) {
    const std::string before = ReadFile(file);
    const Outcome outcome = Run({"--no-refine", "-o", file.string()});
    EXPECT_EQ(outcome.exit_code, kFailed) << file;
    EXPECT_NE(outcome.err.find("this command did not make it: " + file.string()), std::string::npos)
        << outcome.err;
    EXPECT_TRUE(ReadFile(file) == before) << file;
  }
}

TEST_F(MeshCommand, ReportsAndEvaluationsWriteOverTheirOwnFilesAndNoOthers) {
  const fs::path page = folder_ / "page.html", pdf = folder_ / "x.pdf", truth = folder_ / "ball.ply";
  WriteMesh(truth, Ball());
  const std::vector<std::string> report = {"report", Scan().string(), "-o"},
                                 evaluate = {"evaluate",     Scan().string(), "--truth",
                                             truth.string(), "--no-align",    "--html"};
  for (const auto& command : {report, evaluate}) {
    const auto run = [&](const fs::path& output) {
      std::vector<std::string> arguments = command;
      arguments.push_back(output.string());
      return RunPolarscan(arguments);
    };
    WriteFileAtomically(pdf, "%PDF");
    for (int again = 0; again < 2; ++again) EXPECT_EQ(run(page).exit_code, kDone) << run(page).err;
    EXPECT_EQ(run(pdf).exit_code, kFailed);
    EXPECT_EQ(ReadFile(pdf), "%PDF");
    fs::remove(page);
  }
  WriteFileAtomically(Scan() / "evaluation/notes.txt", "mine");
  const Outcome outcome =
      RunPolarscan({"evaluate", Scan().string(), "--truth", truth.string(), "--no-align"});
  EXPECT_EQ(outcome.exit_code, kDone);
  EXPECT_NE(outcome.err.find("the result is not kept"), std::string::npos) << outcome.err;
  EXPECT_EQ(ReadFile(Scan() / "evaluation/notes.txt"), "mine");
}

TEST_F(MeshCommand, ADryRunWritesNothing) {
  const auto before = Contents(Scan());
  const Outcome outcome = Run({"--dry-run"});
  EXPECT_EQ(outcome.exit_code, kDone);
  EXPECT_NE(outcome.err.find("octree depth"), std::string::npos) << outcome.err;
  EXPECT_TRUE(Contents(Scan()) == before);
}

TEST_F(MeshCommand, AWrongEndingIsRefusedBeforeAnyWork) {
  const Outcome outcome = Run({"-o", (folder_ / "m.3ds").string()});
  EXPECT_EQ(outcome.exit_code, kFailed);
  EXPECT_NE(outcome.err.find(".ply, .obj, .glb or .stl"), std::string::npos) << outcome.err;
  EXPECT_FALSE(fs::exists(Scan() / "mesh.ply"));
}

// trimesh is an independent reader of all three formats.
TEST_F(MeshCommand, TrimeshReadsTheThreeFormatsAlike) {
  const Outcome has = Process({"python3", "-c", "import trimesh"}).Wait();
  if (has.exit_code != 0) GTEST_SKIP() << "no Python with trimesh";
  std::vector<std::string> read;
  for (const char* name : {"m.ply", "m.obj", "m.glb"}) {
    const fs::path file = folder_ / name;
    ASSERT_EQ(Run({"--no-refine", "-o", file.string()}).exit_code, kDone);
    read.push_back(Process({"python3", "-c",
                            "import sys, trimesh\n"
                            "m = trimesh.load(sys.argv[1], force='mesh', process=False)\n"
                            "print(len(m.vertices), len(m.faces), m.bounds.round(4).tolist(), "
                            "round(float(m.area), 3))",
                            file.string()})
                       .Wait()
                       .out);
  }
  EXPECT_GT(read[0].size(), 20u);
  EXPECT_EQ(read[0], read[1]);
  EXPECT_EQ(read[0], read[2]);
}

}  // namespace
}  // namespace polarscan::test
