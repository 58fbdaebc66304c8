// SPDX-License-Identifier: Apache-2.0
// What the program keeps when it is killed, stopped or short of memory, and when files of a scan are damaged.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "core/files/files.h"
#include "pipeline/pipeline_scan.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

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

}  // namespace
}  // namespace polarscan::test
