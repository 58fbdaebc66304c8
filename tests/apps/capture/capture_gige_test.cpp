// SPDX-License-Identifier: Apache-2.0
// The simulated GigE camera and who records it: this program, Aravis' tools, another network.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <set>
#include <thread>

#include "acquisition/session/session_reader.h"
#include "capture/capture_program.h"
#include "core/files/files.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

// Waits until `file` holds `words`.
bool WaitForWords(const fs::path& file, const std::string& words) {
  for (int i = 0; i < 600; ++i) {
    if (fs::exists(file) && ReadFile(file).find(words) != std::string::npos) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return false;
}

TEST_F(CaptureProgram, CamerasThatComeAndGoAreSeen) {
  const fs::path words = folder_ / "words.txt";
  const std::string address = OwnAddress(9);
  Process watch({"sh", "-c", "exec \"$0\" cameras --watch 2>\"$1\"", Polarscan({})[0], words.string()});
  ASSERT_TRUE(WaitForWords(words, "here: ")) << "the simulated camera is always there";
  EXPECT_EQ(ReadFile(words).find("gone: "), std::string::npos);
  Process camera(Polarscan({"simulate", "--gige", address, "--width", "128", "--height", "96", "--rings",
                            "33:3", "--samples", "1"}));
  const std::string name = "polarscan-simulated polarization camera";
  EXPECT_TRUE(WaitForWords(words, name)) << ReadFile(words);
  camera.Signal(SIGINT);
  EXPECT_TRUE(WaitForWords(words, "gone: ")) << ReadFile(words);
  watch.Signal(SIGINT);
  EXPECT_EQ(watch.Wait().exit_code, kDone);
}

// A camera that begins with 8 bits is set to 12, and what is seen of it is measured by those.
TEST_F(CaptureProgram, TheLiveViewMeasuresByTheFormatThatIsRecorded) {
  const std::string address = OwnAddress(82);
  Words serve = {"simulate", "--gige",   address, "--pixel-format", "Mono8", "--fps",     "20", "--width",
                 "128",      "--height", "96",    "--rings",        "33:3",  "--samples", "1"};
  serve.insert(serve.end(), {"--exposure", "0.4"});  // so that no highlight of the scene is clipped
  Process camera(Polarscan(serve));
  const Words record = {"capture",          "--camera",  address, "--wait",   "60",           "-o",
                        session().string(), "--seconds", "3",     "--layout", "90 45 / 135 0"};
  const Outcome outcome = RunPolarscan(record);
  ASSERT_TRUE(outcome.exit_code == kDone || outcome.exit_code == kDataLost) << outcome.err;
  EXPECT_NE(outcome.err.find("PixelFormat set from Mono8 to Mono12p"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find("are clipped"), std::string::npos) << outcome.err;
  EXPECT_EQ(ReadJson(session() / "session.json")["sensor"]["bits"], 12);
  // Who comes second reads that the camera is in use.
  Words first = record, second = record;
  first[6] = (folder_ / "first").string(), second[6] = (folder_ / "second").string(), second[4] = "0";
  first.insert(first.end(), {"--set", "ExposureTim=3"});
  EXPECT_NE(RunPolarscan(first).err.find("the camera has no such feature now: ExposureTim"),
            std::string::npos);
  first.resize(first.size() - 2);
  first[8] = "20";
  Process holder(Polarscan(first));
  ASSERT_TRUE(WaitFor(folder_ / "first" / "session.json", holder));
  EXPECT_NE(RunPolarscan(second).err.find("another program controls this camera"), std::string::npos);
  EXPECT_NE(RunPolarscan(serve).err.find("a GigE Vision camera is there already"), std::string::npos);
  holder.Signal(SIGINT);
  camera.Signal(SIGINT);
  EXPECT_EQ(camera.Wait(20).exit_code, kDone);
}

// Aravis' own programs take our camera for a real one.
TEST_F(CaptureProgram, StockToolsReadAndStreamTheSimulatedGigeCamera) {
  if (!HasProgram("arv-tool-0.8") || !HasProgram("arv-camera-test-0.8"))
    GTEST_SKIP() << "arv-tool-0.8 and arv-camera-test-0.8 are not installed (aravis-tools-cli, aravis-tools)";
  const std::string address = OwnAddress(77);
  Process camera(Polarscan({"simulate", "--gige", address, "--width", "128", "--height", "96", "--rings",
                            "33:3", "--samples", "1", "--scene", "sphere", "--no-table", "--pixel-format",
                            "Mono8", "--fps", "20"}));
  Outcome features;
  for (int round = 0; round < 30 && features.out.find("SensorWidth") == std::string::npos; ++round)
    features = Process({"arv-tool-0.8", "-a", address, "values"}).Wait(20);
  EXPECT_NE(features.out.find("'SensorWidth' = 128"), std::string::npos) << features.out << features.err;
  EXPECT_NE(features.out.find("'PixelFormat' = 'Mono8'"), std::string::npos) << features.out;
  const Outcome stream = Process({"arv-camera-test-0.8", "--name=" + address, "-a", "--duration=6"}).Wait(60);
  const std::string key = "n_completed_buffers    = ";
  const std::size_t at = stream.out.find(key);
  ASSERT_NE(at, std::string::npos) << stream.out << stream.err;
  EXPECT_GT(std::stoi(stream.out.substr(at + key.size())), 20) << stream.out;
  camera.Signal(SIGINT);
  EXPECT_EQ(camera.Wait(20).exit_code, kDone);
}

// On a machine busy enough a frame is lost on the way, and counted; those that are stored are the
// recording's.
TEST_F(CaptureProgram, ARecordingPlayedAsAGigeCameraIsRecordedAgainByteForByte) {
  ASSERT_EQ(RunPolarscan(CaptureWords(session(), {"--frames", "12", "--set", "fps=20"})).exit_code, kDone);
  const std::string address = OwnAddress(78);
  Process camera(Polarscan({"replay", session().string(), "--gige", address}));
  const fs::path again = folder_ / "again";
  Outcome outcome;
  for (int round = 0; round < 30 && !fs::exists(again / "session.json"); ++round)
    outcome = RunPolarscan({"capture", "--camera", address, "-o", again.string(), "--frames", "12",
                            "--seconds", "15", "--layout", "90 45 / 135 0"});
  ASSERT_TRUE(outcome.exit_code == kDone || outcome.exit_code == kDataLost) << outcome.err;
  std::set<std::uint64_t> recorded, repeated;
  for (const StoredFrame& frame : OpenSession(session(), Verify::kPayloads).frames)
    recorded.insert(frame.hash);
  for (const StoredFrame& frame : OpenSession(again, Verify::kPayloads).frames) repeated.insert(frame.hash);
  EXPECT_EQ(recorded.size(), 12u);
  EXPECT_GE(repeated.size(), 6u) << outcome.err;
  EXPECT_TRUE(std::includes(recorded.begin(), recorded.end(), repeated.begin(), repeated.end()));
}

// From the camera to the cloud in a network of its own, by an ordinary user.
TEST_F(CaptureProgram, WithoutRootInItsOwnNetworkTheGigeCameraIsRecordedAndReconstructed) {
  const std::string script = R"(
    set -e
    ip link set lo up || exit 77
    "$0" --quiet simulate --gige 127.0.0.1 --fps 10 -o "$1/camera" --masks --known-poses --width 128 --height 96 \
      --rings 33:8 --samples 1 --texture strong &
    camera=$!
    trap 'kill $camera' EXIT
    "$0" capture --camera 127.0.0.1 --wait 60 -o "$1/session" --frames 8 --layout "90 45 / 135 0" --black-level 60
    kill -INT $camera; trap - EXIT
    cp -r "$1/camera/masks" "$1/camera/sparse" "$1/session"
    "$0" reconstruct "$1/session" -o "$1/scan" --levels 1
    "$0" evaluate "$1/scan" --truth "$1/camera/truth/mesh.ply" --json
  )";
  fs::permissions(folder_.path(), fs::perms::all);
  Words argv = {"unshare",         "--map-root-user",      "--net", "sh", "-c", script,
                POLARSCAN_PROGRAM, folder_.path().string()};
  if (::geteuid() == 0) {
    const Words as_nobody = {"setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"};
    argv.insert(argv.begin(), as_nobody.begin(), as_nobody.end());
  }
  const Outcome outcome = Process(argv, {{"HOME", folder_.path().string()}}).Wait(200);
  if (outcome.exit_code == 77 || outcome.err.find("unshare") == 0 || outcome.err.find("setpriv") == 0)
    GTEST_SKIP() << "this system gives us no network of our own: " << outcome.err;
  ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
  const nlohmann::json found = nlohmann::json::parse(outcome.out);
  EXPECT_LT(found.at("maps").at("mean").at("depth").at("over_all").at("median"), 0.05) << found.dump();
  EXPECT_EQ(OpenSession(session()).frames.size(), 8u);
}

}  // namespace
}  // namespace polarscan::test
