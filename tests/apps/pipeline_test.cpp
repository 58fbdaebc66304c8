// SPDX-License-Identifier: Apache-2.0
// The whole program on a small simulated set with known poses: what it makes, what it skips, and what it
// keeps when it is killed. Options are chosen for speed, not for quality; the bounds are those of a coarse
// but right reconstruction.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <memory>
#include <set>
#include <thread>

#include "core/files.h"
#include "core/mesh.h"
#include "core/ply.h"
#include "core/random.h"
#include "program.h"
#include "report_data.h"
#include "stereo/sfm/alignment.h"
#include "stereo/sfm/model/model.h"
#include "toy_scan.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

// Pictures of a textured ball with masks and poses. The ball has radius 1.
Outcome Simulate(const fs::path& mesh, const fs::path& folder, const std::string& rings, int width,
                 int height) {
  WriteMesh(mesh, Ball());
  return RunPolarscan({"simulate", "-o", folder.string(), "--mesh", mesh.string(), "--no-table", "--texture",
                       "strong", "--samples", "1", "--masks", "--known-poses", "--rings", rings, "--width",
                       std::to_string(width), "--height", std::to_string(height)});
}

// Few and tiny pictures: what comes out is coarse, and each test takes seconds.
class Pipeline : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    suite_ = std::make_unique<TemporaryFolder>();
    const Outcome outcome = Simulate(*suite_ / "ball.ply", Input(), "30:8", 64, 56);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  static void TearDownTestSuite() { suite_.reset(); }

  static fs::path Input() { return *suite_ / "input"; }
  fs::path Folder(const std::string& name) const { return folder_ / name; }

  static std::vector<std::string> Command(const fs::path& scan, const std::vector<std::string>& more = {},
                                          const fs::path& input = Input()) {
    std::vector<std::string> arguments = {"reconstruct", input.string(), "-o", scan.string(), "--no-filter"};
    for (const auto& [name, value] : std::map<std::string, std::string>{{"photometric-iterations", "1"},
                                                                        {"geometric-iterations", "1"},
                                                                        {"window-radius", "2"},
                                                                        {"samples", "4"},
                                                                        {"sources", "4"},
                                                                        {"fusion-min-views", "2"}}) {
      if (std::find(more.begin(), more.end(), "--" + name) == more.end())
        arguments.insert(arguments.end(), {"--" + name, value});
    }
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  static std::unique_ptr<TemporaryFolder> suite_;
  TemporaryFolder folder_;
};
std::unique_ptr<TemporaryFolder> Pipeline::suite_;

// What must be the same bytes for the same seed: maps and cloud.
std::map<std::string, std::string> Results(const fs::path& scan) {
  std::map<std::string, std::string> results = Contents(scan / "dense/stereo/depth_maps");
  results.merge(Contents(scan / "dense/stereo/normal_maps"));
  results["cloud.ply"] = ReadFile(scan / "cloud.ply");
  return results;
}

void ExpectSameResults(const fs::path& a, const fs::path& b) {
  const auto results_a = Results(a), results_b = Results(b);
  ASSERT_EQ(results_a.size(), results_b.size());
  for (const auto& [name, bytes] : results_a) {
    ASSERT_TRUE(results_b.contains(name)) << name;
    EXPECT_TRUE(results_b.at(name) == bytes) << name << " differs";
  }
}

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

TEST_F(Pipeline, ADamagedMapIsLeftOutCountedAndRepaired) {
  const fs::path scan = Folder("scan"), other = Folder("other");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  fs::copy(scan, other, fs::copy_options::recursive);
  const fs::path map = scan / "dense/stereo/depth_maps/000003.png.geometric.bin";
  fs::resize_file(map, fs::file_size(map) / 2);
  fs::remove(scan / "cloud.ply");
  const std::vector<std::string> fuse = {"--json", "fuse", scan.string(), "--fusion-min-views", "2"};
  for (int times = 0; times < 2; ++times) {  // it is not done until all views are in
    const Outcome damaged = RunPolarscan(fuse);
    EXPECT_EQ(damaged.exit_code, kDataLost) << damaged.err;
    EXPECT_NE(damaged.err.find(map.string()), std::string::npos) << damaged.err;
    EXPECT_EQ(json::parse(damaged.out).at("damaged_views"), json::array({"000003"}));
    EXPECT_EQ(json::parse(damaged.out).at("views"), 7);
  }
  std::vector<std::string> repair = fuse;
  repair.push_back("--repair");
  const Outcome repaired = RunPolarscan(repair);
  ASSERT_EQ(repaired.exit_code, 0) << repaired.err;
  EXPECT_EQ(json::parse(repaired.out).at("damaged"), 0);
  ExpectSameResults(scan, other);
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

TEST_F(Pipeline, TheSameCommandAgainDoesNothingAndAChangedOptionOnlyWhatDependsOnIt) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  const auto depth_time = fs::last_write_time(scan / "dense/stereo/depth_maps/000000.png.geometric.bin");
  const auto cloud_time = fs::last_write_time(scan / "cloud.ply");

  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  EXPECT_EQ(fs::last_write_time(scan / "cloud.ply"), cloud_time);

  ASSERT_EQ(RunPolarscan(Command(scan, {"--fusion-reprojection", "0.6"})).exit_code, 0);
  EXPECT_EQ(fs::last_write_time(scan / "dense/stereo/depth_maps/000000.png.geometric.bin"), depth_time);
  EXPECT_GT(fs::last_write_time(scan / "cloud.ply"), cloud_time);
}

// What a dry run says of each stage: "" if it is done, else why it would be made.
std::map<std::string, std::string> Plan(std::vector<std::string> command) {
  command.insert(command.end(), {"--dry-run", "--json"});
  const Outcome outcome = RunPolarscan(command);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  std::map<std::string, std::string> plan;
  const json printed = json::parse(outcome.out);
  for (const json& stage : printed.at("plan")) {
    EXPECT_EQ(stage.at("done"), stage.at("why") == "");
    plan[stage.at("stage")] = stage.at("why");
  }
  return plan;
}

std::map<std::string, std::string> AllDone() {
  return {{"views", ""},  {"sfm", ""},  {"dense", ""}, {"stereo", ""},
          {"fusion", ""}, {"mesh", ""}, {"report", ""}};
}

TEST_F(Pipeline, ADryRunSaysWhatWouldBeMadeAndWhyAndTouchesNothing) {
  const fs::path scan = Folder("scan");
  EXPECT_EQ(Plan(Command(scan)).at("views"), "it was not made yet");
  EXPECT_FALSE(fs::exists(scan));
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  const auto before = Contents(scan);
  EXPECT_EQ(Plan(Command(scan)), AllDone());

  auto other_fusion = AllDone();
  other_fusion["fusion"] = "fusion-reprojection: 0.8 -> 0.6";
  other_fusion["mesh"] = other_fusion["report"] = "unless stage fusion comes out the same again";
  EXPECT_EQ(Plan(Command(scan, {"--fusion-reprojection", "0.6"})), other_fusion);
  auto other_views = Plan(Command(scan, {"--demosaic", "bilinear"}));
  EXPECT_NE(other_views.at("views").find("-> \"bilinear\""), std::string::npos) << other_views.at("views");
  EXPECT_EQ(other_views.at("stereo"), "unless stage views comes out the same again");
  EXPECT_TRUE(before == Contents(scan));
}

TEST_F(Pipeline, WhatIsWrongWithKnownPosesShowsBeforeAnythingIsMadeAlsoInADryRun) {
  const fs::path input = Folder("input"), images = input / "sparse/0/images.txt";
  fs::copy(Input(), input, fs::copy_options::recursive);
  fs::remove_all(input / "sparse");
  fs::create_directory(input / "sparse");
  fs::copy(Input() / "sparse", input / "sparse/0", fs::copy_options::recursive);
  EXPECT_EQ(Plan(Command(Folder("scan"), {}, input)).at("sfm"), "it was not made yet") << "one folder down";

  SparseModel model = ReadSparseModel(input / "sparse");
  model.images.erase(std::prev(model.images.end()));
  WriteSparseModelText(input / "sparse/0", model);
  const Outcome without = RunPolarscan(Command(Folder("scan"), {"--dry-run"}, input));
  EXPECT_EQ(without.exit_code, kDone);
  EXPECT_NE(without.err.find("7 of 8 views have a known pose; the model has none for 000007"),
            std::string::npos)
      << without.err;

  WriteFileAtomically(images, "1 1 0 0 0 a 0 3 1 000000.png\n");
  for (const std::vector<std::string>& more : {std::vector<std::string>{"--dry-run"}, {}}) {
    const Outcome outcome = RunPolarscan(Command(Folder("scan"), more, input));
    EXPECT_EQ(outcome.exit_code, kFailed);
    EXPECT_NE(outcome.err.find("line 1"), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(Folder("scan"))) << "nothing was made";
  }
}

TEST_F(Pipeline, ADamagedFileOfTheSameSizeIsNoticedAndWhatComesOutTheSameIsNotFollowed) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  const auto before = Results(scan);
  const auto cloud_time = fs::last_write_time(scan / "cloud.ply");
  for (const char* name : {"views/000002.tif", "sfm/model/images.bin", "dense/masks/000001.png"}) {
    const fs::path file = scan / name;
    std::string bytes = ReadFile(file);
    bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 4);
    WriteFileAtomically(file, bytes);
    const std::string stage = std::string(name).substr(0, std::string(name).find('/'));
    EXPECT_EQ(Plan(Command(scan)).at(stage), std::string(name) + " is damaged or was changed");
    const Outcome found = RunPolarscan({"check", scan.string()});
    EXPECT_EQ(found.exit_code, kDataLost);
    EXPECT_NE(found.err.find(name), std::string::npos) << found.err;
    ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
    EXPECT_EQ(Plan(Command(scan)), AllDone());
  }
  EXPECT_TRUE(Results(scan) == before);
  EXPECT_EQ(fs::last_write_time(scan / "cloud.ply"), cloud_time) << "made anew though nothing had changed";
}

TEST_F(Pipeline, AnEarlierStageRemadeByHandMakesTheLaterOnesUndone) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  ASSERT_EQ(RunPolarscan({"sfm", scan.string(), "--max-image-size", "40"}).exit_code, 0);
  const Outcome fuse = RunPolarscan({"fuse", scan.string()});
  EXPECT_EQ(fuse.exit_code, kFailed);
  EXPECT_NE(fuse.err.find("stage 'stereo' of this scan was made from another result of stage 'dense'"),
            std::string::npos)
      << fuse.err;
}

TEST_F(Pipeline, ADamagedScanJsonAndLostChecksumsCostNoResult) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  const auto before = Results(scan);
  fs::remove(scan / "checksums.json");
  EXPECT_EQ(RunPolarscan({"check", scan.string(), "--repair"}).exit_code, kDone) << "scan.json has digests";
  EXPECT_FALSE(fs::exists(scan / "damaged"));
  EXPECT_EQ(Plan(Command(scan)), AllDone());
  fs::resize_file(scan / "scan.json", 1000);
  const Outcome outcome = RunPolarscan(Command(scan));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("kept as scan.json.damaged"), std::string::npos) << outcome.err;
  EXPECT_TRUE(Results(scan) == before);
}

TEST_F(Pipeline, RepairMovesWhatIsDamagedAwayAndTheSameCommandMakesItAgain) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  const auto before = Results(scan);
  fs::resize_file(scan / "cloud.ply", 100);
  EXPECT_EQ(RunPolarscan({"check", scan.string(), "--repair"}).exit_code, kDataLost);
  EXPECT_EQ(fs::file_size(scan / "damaged/cloud.ply"), 100u);
  EXPECT_FALSE(fs::exists(scan / "cloud.ply"));
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  EXPECT_EQ(RunPolarscan({"check", scan.string()}).exit_code, kDone);
  EXPECT_TRUE(Results(scan) == before);
}

TEST_F(Pipeline, TooLittleMemoryIsSaidPlainlyAndTheScanGoesOn) {
  const fs::path scan = Folder("scan");
  for (const char* kilobytes : {"60000", "100000"}) {  // enough to start with
    const std::string limited = std::string("ulimit -d ") + kilobytes + " && exec \"$0\" \"$@\"";
    std::vector<std::string> argv = {"sh", "-c", limited};
    const std::vector<std::string> program = Polarscan(Command(scan, {"--threads", "1"}));
    argv.insert(argv.end(), program.begin(), program.end());
    const Outcome outcome = Process(argv).Wait(60);
    EXPECT_EQ(outcome.exit_code, kFailed) << kilobytes << " KB";
    EXPECT_NE(outcome.err.find("not enough memory"), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
}

TEST_F(Pipeline, OneStageRunsAgainWithOtherOptionsAndTheNextOneFollowsIt) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  const auto before = Results(scan);

  const Outcome stereo = RunPolarscan({"stereo", scan.string(), "--no-filter", "--photometric-iterations",
                                       "1", "--geometric-iterations", "1", "--window-radius", "3",
                                       "--samples", "4", "--sources", "4"});
  ASSERT_EQ(stereo.exit_code, 0) << stereo.err;
  EXPECT_EQ(ReadJson(scan / "scan.json")["options"]["stereo"]["window-radius"], 3);
  EXPECT_TRUE(before.at("cloud.ply") == ReadFile(scan / "cloud.ply")) << "stereo touched the cloud";

  ASSERT_EQ(RunPolarscan({"fuse", scan.string(), "--fusion-min-views", "2"}).exit_code, 0);
  EXPECT_FALSE(before.at("cloud.ply") == ReadFile(scan / "cloud.ply"));

  // The first command again gives the first results again.
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  EXPECT_TRUE(Results(scan) == before);
}

TEST_F(Pipeline, AMeshOfAnEarlierCloudIsNamedAndNotInTheReport) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  EXPECT_FALSE(DataOf(ReadFile(scan / "report.html")).at("mesh").is_null());
  const Outcome same = RunPolarscan(Command(scan, {"--no-mesh"}));
  EXPECT_EQ(same.err.find("earlier cloud"), std::string::npos) << same.err;

  const Outcome other = RunPolarscan(Command(scan, {"--no-mesh", "--fusion-min-views", "3"}));
  ASSERT_EQ(other.exit_code, 0) << other.err;
  EXPECT_NE(other.err.find("mesh.ply is of an earlier cloud"), std::string::npos) << other.err;
  const json data = DataOf(ReadFile(scan / "report.html"));
  EXPECT_TRUE(data.at("mesh").is_null());
  EXPECT_NE(data.at("notes").dump().find("earlier cloud"), std::string::npos);
  const Outcome check = RunPolarscan({"check", scan.string()});
  EXPECT_EQ(check.exit_code, kDone) << check.err;
  EXPECT_NE(check.err.find("mesh: out of date"), std::string::npos) << check.err;
}

TEST_F(Pipeline, SeveralFoldersMakeOneScanInAnyOrder) {
  const fs::path other = Folder("other"), scan = Folder("scan");
  fs::copy(Input(), other, fs::copy_options::recursive);
  const auto run = [&](const fs::path& a, const fs::path& b) {  // without COLMAP: the views are what matters
    return RunPolarscan({"reconstruct", a.string(), b.string(), "-o", scan.string()}, {{"PATH", "/nowhere"}});
  };
  run(Input(), other);
  const Outcome turned = run(other, Input());
  EXPECT_NE(turned.err.find("views    done before"), std::string::npos) << turned.err;
}

TEST_F(Pipeline, AStageOfAFolderThatIsNoScanIsRefused) {
  for (const char* stage : {"sfm", "stereo", "fuse", "mesh"}) {
    const Outcome outcome = RunPolarscan({stage, Input().string()});
    EXPECT_EQ(outcome.exit_code, 1) << stage;
    EXPECT_NE(outcome.err.find("polarscan reconstruct"), std::string::npos) << outcome.err;
  }
}

TEST_F(Pipeline, ALostResultIsMadeAgain) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  const auto before = Results(scan);
  fs::remove(scan / "dense/stereo/depth_maps/001.png.geometric.bin");
  fs::resize_file(scan / "cloud.ply", 100);
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  EXPECT_TRUE(Results(scan) == before);
}

TEST_F(Pipeline, KilledAtAnyMomentItGoesOnToTheSameBytes) {
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_EQ(RunPolarscan(Command(Folder("whole"))).exit_code, 0);
  const auto whole = std::chrono::steady_clock::now() - begin;

  const fs::path scan = Folder("killed");
  for (const double share : {0.1, 0.3, 0.5, 0.7}) {  // of the time that the rest may take
    Process process(Polarscan(Command(scan)));
    std::this_thread::sleep_for(whole * share);
    process.Signal(SIGKILL);
    process.Wait();
  }
  const Outcome outcome = RunPolarscan(Command(scan));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  ExpectSameResults(Folder("whole"), scan);
}

TEST_F(Pipeline, CtrlCStopsWithinASecondAndSaysHowToGoOn) {
  const fs::path scan = Folder("scan");
  Process process(Polarscan(Command(scan, {"--photometric-iterations", "50"})));
  while (process.Running() && !fs::exists(scan / "dense/views.json"))
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // into stereo
  ASSERT_TRUE(process.Running());
  const auto begin = std::chrono::steady_clock::now();
  process.Signal(SIGINT);
  const Outcome outcome = process.Wait(20);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_LT(seconds, 2.0);  // a second by itself, twice that on a busy machine
  EXPECT_NE(outcome.err.find("same command again"), std::string::npos) << outcome.err;
  EXPECT_EQ(ReadJson(scan / "scan.json")["stages"]["stereo"]["state"], "running");
}

TEST_F(Pipeline, TwoProgramsDoNotWorkOnOneScan) {
  const fs::path scan = Folder("scan");
  Process first(Polarscan(Command(scan, {"--photometric-iterations", "50"})));
  while (first.Running() && !fs::exists(scan / "scan.json"))
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  const Outcome second = RunPolarscan(Command(scan));
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_NE(second.err.find(scan.string()), std::string::npos) << second.err;
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
    return AlignCameras(Poses(model), Poses(truth)).rms;
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

TEST_F(Pipeline, AScanMovedTogetherWithItsInputGoesOn) {
  fs::create_directory(Folder("before"));
  fs::copy(Input(), Folder("before/input"), fs::copy_options::recursive);
  ASSERT_EQ(RunPolarscan(Command(Folder("before/scan"), {}, Folder("before/input"))).exit_code, 0);
  const auto before = Results(Folder("before/scan"));
  fs::rename(Folder("before"), Folder("after"));
  const Outcome outcome = RunPolarscan(Command(Folder("after/scan"), {}, Folder("after/input")));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("stereo   done before"), std::string::npos) << outcome.err;
  EXPECT_TRUE(Results(Folder("after/scan")) == before);
  EXPECT_EQ(ReadJson(Folder("after/scan/scan.json"))["input"], Folder("after/input").string());
  EXPECT_EQ(RunPolarscan({"sfm", Folder("after/scan").string()}).exit_code, 0) << "poses by their old path";
}

TEST_F(Pipeline, AScanCopiedTogetherWithItsInputGoesOnWhileTheOriginalIsThere) {
  fs::create_directories(Folder("first"));
  fs::copy(Input(), Folder("first/pictures"), fs::copy_options::recursive);
  const auto command = [&](const char* where) {
    std::vector<std::string> words = Command(Folder(where) / "scan");
    words[1] = (Folder(where) / "pictures").string();
    return words;
  };
  ASSERT_EQ(RunPolarscan(command("first")).exit_code, 0);
  fs::copy(Folder("first"), Folder("second"), fs::copy_options::recursive);
  const Outcome copy = RunPolarscan(command("second"));
  EXPECT_EQ(copy.exit_code, 0) << copy.err;
  std::vector<std::string> mixed = command("second");
  mixed[1] = (Folder("first") / "pictures").string();
  EXPECT_NE(RunPolarscan(mixed).err.find("a scan of another input"), std::string::npos);
}

// A wrong option costs no result, and what is of earlier maps says so.
TEST_F(Pipeline, AFailedStageLosesNothingAndWhatIsOutOfDateIsNamedEverywhere) {
  const fs::path scan = Folder("scan");
  ASSERT_EQ(RunPolarscan(Command(scan)).exit_code, 0);
  const auto says = [](const Outcome& outcome, const std::string& words) {
    EXPECT_NE(outcome.err.find(words), std::string::npos) << words << "\n" << outcome.err;
  };
  EXPECT_EQ(RunPolarscan({"stereo", scan.string(), "--views", "cup*"}).exit_code, kFailed);
  EXPECT_EQ(RunPolarscan({"fuse", scan.string(), "--fusion-maps", "photometric"}).exit_code, kFailed);
  const Outcome whole = RunPolarscan({"check", scan.string()});
  EXPECT_EQ(whole.err.find("out of date"), std::string::npos) << whole.err;
  says(RunPolarscan(Command(scan)), "fusion   done before");
  {
    const Descriptor other = LockFolder(scan, "scan");
    EXPECT_EQ(RunPolarscan({"check", scan.string()}).exit_code, kDone) << "it only looks";
  }
  const std::string truth = (Input() / "truth").string();
  ASSERT_EQ(RunPolarscan({"evaluate", scan.string(), "--truth", truth}).exit_code, kDone);
  ASSERT_EQ(
      RunPolarscan({"stereo", scan.string(), "--preset", "fast", "--window-radius", "3", "--samples", "4"})
          .exit_code,
      kDone);
  says(RunPolarscan({"check", scan.string()}),
       "fusion: out of date, it is of an earlier result of stage stereo");
  ASSERT_EQ(RunPolarscan({"report", scan.string()}).exit_code, kDone);
  const std::string notes = DataOf(ReadFile(scan / "report.html")).at("notes").dump();
  EXPECT_NE(notes.find("The cloud is not of these maps"), std::string::npos) << notes;
  EXPECT_NE(notes.find("The evaluation is of earlier maps"), std::string::npos) << notes;
  says(RunPolarscan({"evaluate", scan.string(), "--truth", truth}), "the cloud is out of date");
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
    EXPECT_EQ(state.at(json::json_pointer("/stages/stereo/counts/angles/wrong")), *cure != 0)
        << state.at(json::json_pointer("/stages/stereo/counts"));
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
