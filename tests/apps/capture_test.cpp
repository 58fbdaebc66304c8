// SPDX-License-Identifier: Apache-2.0
// Recording through the program as users meet it: Ctrl-C, kill -9, a full disk, damage, and the way from a
// session to views.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <set>
#include <thread>

#include "acquisition/session/session_reader.h"
#include "apps/terminal.h"
#include "core/files.h"
#include "core/image_io.h"
#include "core/random.h"
#include "program.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

using Words = std::vector<std::string>;

// A small camera, quickly ready.
Words CaptureWords(const fs::path& session, const Words& more = {}) {
  Words words = {"capture", "--camera", "simulated", "-o", session.string()};
  for (const char* setting :
       {"width=64", "height=48", "rings=33:3", "samples=1", "scene=sphere", "table=false", "blocks=false"})
    words.insert(words.end(), {"--set", setting});
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

// What a program writes to a terminal of so many columns, until it ends.
std::string OnTerminal(const Words& words, unsigned short columns) {
  const winsize size{24, columns, 0, 0};
  int terminal = -1;
  const pid_t child = ::forkpty(&terminal, nullptr, nullptr, &size);
  if (child == 0) {
    ::setenv("TERM", "xterm", 1);
    std::vector<char*> argv;
    for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  std::string text;
  char buffer[4096];
  for (ssize_t n; (n = ::read(terminal, buffer, sizeof buffer)) > 0;) text.append(buffer, std::size_t(n));
  int status = 0;
  ::waitpid(child, &status, 0);
  ::close(terminal);
  EXPECT_EQ(status, 0) << text;
  return text;
}

// The lines that are drawn over each other.
std::vector<std::string> LiveLines(const std::string& text) {
  const std::string redraw = "\r\x1b[K";
  std::vector<std::string> lines;
  for (std::size_t at = text.find(redraw); at != std::string::npos;) {
    const std::size_t begin = at + redraw.size();
    at = text.find(redraw, begin);
    const std::string line = text.substr(begin, at - begin);
    if (at != std::string::npos && !line.empty() && line.find('\n') == std::string::npos)
      lines.push_back(line);
  }
  return lines;
}

bool WaitFor(const fs::path& path, Process& process) {
  while (process.Running() && !fs::exists(path)) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  return fs::exists(path);
}

class CaptureProgram : public testing::Test {
 protected:
  fs::path session() const { return folder_ / "session"; }
  // An address for a GigE camera that no other test has.
  static std::string OwnAddress(int net) {
    return fmt::format("127.{}.{}.{}", net, getpid() / 250 % 250, 1 + getpid() % 250);
  }
  fs::path segment() const { return session() / "segments" / "000000.seg"; }
  nlohmann::json CheckJson(int expected_code) {
    const Outcome outcome = RunPolarscan({"--json", "check", session().string()});
    EXPECT_EQ(outcome.exit_code, expected_code) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  }
  TemporaryFolder folder_;
};

TEST_F(CaptureProgram, AFewFramesAreRecordedAndTheResultIsJsonOnStdout) {
  Words words = CaptureWords(session(), {"--frames", "5", "--set", "fps=100"});
  words.insert(words.begin(), "--json");
  const Outcome outcome = RunPolarscan(words);
  ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
  const nlohmann::json result = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(result["stored"], 5);
  EXPECT_EQ(result["lost"], 0);
  EXPECT_EQ(CheckJson(kDone)["frames"], 5);
}

TEST_F(CaptureProgram, LostFramesAreSaidAndTheExitCodeTellsToo) {
  const Outcome outcome = RunPolarscan(
      CaptureWords(session(), {"--frames", "30", "--set", "fps=500", "--set", "frame-loss=0.3"}));
  EXPECT_EQ(outcome.exit_code, kDataLost) << outcome.err;
  EXPECT_NE(outcome.err.find("never came"), std::string::npos) << outcome.err;
}

TEST_F(CaptureProgram, TheLiveLineIsNoWiderThanItsTerminal) {
  for (const unsigned short columns : {20, 40, 80}) {
    fs::remove_all(session());
    const Words words = CaptureWords(session(), {"--set", "fps=50", "--seconds", "1.5"});
    const std::vector<std::string> lines = LiveLines(OnTerminal(Polarscan(words), columns));
    ASSERT_GT(lines.size(), 4u);
    for (const std::string& line : lines) EXPECT_LT(line.size(), columns) << line;
    const auto has = [&](const char* part) {
      return std::ranges::any_of(lines, [&](const auto& line) { return line.find(part) != line.npos; });
    };
    EXPECT_TRUE(has(" frames/s"));
    EXPECT_EQ(has(" stored"), columns >= 40);
  }
}

TEST(TerminalLine, IsCutBehindAWholePart) {
  EXPECT_EQ(FitTo("  24.0 frames/s, 120.0 MB/s", 27), "  24.0 frames/s, 120.0 MB/s");
  EXPECT_EQ(FitTo("  24.0 frames/s, 120.0 MB/s", 26), "  24.0 frames/s");
  EXPECT_EQ(FitTo("  24.0 frames/s, 120.0 MB/s", 15), "  24.0 frames/s");
  EXPECT_EQ(FitTo("  24.0 frames/s, 120.0 MB/s", 14), "  24.0");
  EXPECT_EQ(FitTo("abcdefgh", 3), "abc");
  EXPECT_EQ(FitTo("abc", 0), "");
}

TEST(TerminalLine, CountsColumnsAndNotBytes) {
  EXPECT_EQ(FitTo("\xC3\xA4\xC3\xB6\xC3\xBC", 3), "\xC3\xA4\xC3\xB6\xC3\xBC");  // a, o, u with dots
  EXPECT_EQ(FitTo("\xE5\x9C\x96\xE5\x83\x8F", 3), "\xE5\x9C\x96");              // two wide ones
  EXPECT_EQ(FitTo("e\xCC\x81"
                  "f",
                  2),
            "e\xCC\x81"
            "f");                                 // an accent of its own
  EXPECT_EQ(FitTo("a\nb\x1b[2J", 10), "ab[2J");   // no orders to the terminal
  EXPECT_EQ(FitTo("\xFF\xE5z", 3), "\xFF\xE5z");  // no UTF-8 at all
}

TEST_F(CaptureProgram, CtrlCEndsTheSessionInOrder) {
  Process process(Polarscan(CaptureWords(session(), {"--set", "fps=50"})));
  ASSERT_TRUE(WaitFor(segment(), process));
  process.Signal(SIGINT);
  const Outcome outcome = process.Wait();
  EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
  EXPECT_EQ(CheckJson(kDone)["state"], "closed");
}

TEST_F(CaptureProgram, KilledRecordingsHoldWholeFramesOnlyAndCanBeRepaired) {
  Random random(4);
  for (int round = 0; round < 8; ++round) {
    fs::remove_all(session());
    Process process(Polarscan(CaptureWords(session(), {"--set", "fps=2000"})));
    ASSERT_TRUE(WaitFor(segment(), process));
    std::this_thread::sleep_for(std::chrono::milliseconds(random.Below(150)));
    process.Signal(SIGKILL);
    process.Wait();
    const nlohmann::json found = CheckJson(kDone);
    EXPECT_EQ(found["state"], "recording");
    EXPECT_EQ(found["damage"].size(), 0u);
    EXPECT_EQ(RunPolarscan({"check", session().string(), "--repair"}).exit_code, kDone);
    const nlohmann::json repaired = CheckJson(kDone);
    EXPECT_EQ(repaired["state"], "closed");
    EXPECT_EQ(repaired["frames"], found["frames"]);
    EXPECT_EQ(repaired["unfinished"].size(), 0u);
  }
}

TEST_F(CaptureProgram, AFlippedBitIsFoundByCheckAndTheOtherFramesStayUsable) {
  ASSERT_EQ(RunPolarscan(CaptureWords(session(), {"--frames", "4", "--set", "fps=100"})).exit_code, kDone);
  std::string bytes = ReadFile(segment());
  bytes[bytes.size() / 2 + 1000] ^= 4;  // in a payload
  WriteFileAtomically(segment(), bytes);
  const nlohmann::json found = CheckJson(kDataLost);
  EXPECT_EQ(found["frames"], 3);
  EXPECT_EQ(found["damage"].size(), 1u);
  const Outcome views =
      RunPolarscan({"--json", "demosaic", session().string(), "-o", (folder_ / "views").string()});
  ASSERT_EQ(views.exit_code, kDataLost) << views.err;
  EXPECT_EQ(nlohmann::json::parse(views.out)["views"], 3);
  EXPECT_NE(views.err.find("warning: the session is damaged"), std::string::npos) << views.err;
  const fs::path scan = folder_ / "scan";
  const Outcome plan = RunPolarscan({"reconstruct", session().string(), "-o", scan.string(), "--dry-run"});
  EXPECT_EQ(plan.exit_code, kDataLost) << plan.err;
  EXPECT_NE(plan.err.find("warning: the session is damaged"), std::string::npos) << plan.err;
  RunPolarscan({"reconstruct", session().string(), "-o", scan.string()}, {{"PATH", "/nowhere"}});
  EXPECT_NE(ReadJson(scan / "scan.json")["warnings"].dump().find("the session is damaged"),
            std::string::npos);
}

TEST_F(CaptureProgram, AFullDiskEndsTheRecordingWithAWordAndLeavesAUsableSession) {
  const std::string disk = (folder_ / "disk").string();
  fs::create_directory(disk);
  // All in one mount namespace, because the small disk is gone with it.
  const std::string script =
      "mount -t tmpfs -o size=300k tmpfs \"$0\" || exit 77; \"$@\"; code=$?; " POLARSCAN_PROGRAM
      " --json check \"$0/session\" || exit 78; exit $code";
  Words argv = {"unshare", "--map-root-user", "--mount", "sh", "-c", script, disk};
  const Words program = Polarscan(CaptureWords(fs::path(disk) / "session", {"--set", "fps=200"}));
  argv.insert(argv.end(), program.begin(), program.end());
  if (!HasProgram("unshare")) GTEST_SKIP() << "there is no unshare";
  const Outcome outcome = Process(argv).Wait();
  if (outcome.exit_code == 77 || outcome.err.find("unshare") == 0)
    GTEST_SKIP() << "this system does not let us mount a file system of our own";
  EXPECT_EQ(outcome.exit_code, kFailed) << outcome.err;
  EXPECT_NE(outcome.err.find("disk full"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("stored before are safe"), std::string::npos) << outcome.err;
  const nlohmann::json found = nlohmann::json::parse(outcome.out);
  EXPECT_GT(found["frames"], 10);
  EXPECT_EQ(found["damage"].size(), 0u);
}

// Commands that do not go on where they stopped, on pictures of a camera's real size.
TEST_F(CaptureProgram, CtrlCAtAnyMomentIsAnsweredWithinASecond) {
  const fs::path pictures = folder_ / "pictures", out = folder_ / "out";
  Image<std::uint16_t> mosaic(2448, 2048);
  for (int k = 0; k < 6; ++k) {
    for (std::size_t i = 0; i < mosaic.size(); ++i)
      mosaic.pixels()[i] = std::uint16_t(60 + (i * 2654435761u >> 20) % 64 + std::size_t(k));
    WritePng(pictures / "mosaic" / fmt::format("{}.png", k), mosaic);
  }
  WriteJson(pictures / "set.json", {{"sensor", {{"layout", "90 45 / 135 0"}, {"bits", 12}}}});
  ASSERT_EQ(RunPolarscan({"import", pictures.string(), "-o", session().string()}).exit_code, kDone);
  const std::string recording = session().string(), to = out.string();
  const Words real = {"--width", "2448", "--height", "2048", "--rings", "33:4"};
  Words camera = {"capture", "--camera", "simulated", "-o", to};
  for (const char* set : {"width=2448", "height=2048", "rings=33:4"})
    camera.insert(camera.end(), {"--set", set});
  Words simulate = {"simulate", "--masks", "-o", to}, serve = {"simulate", "--gige", OwnAddress(80)};
  for (Words* words : {&simulate, &serve}) words->insert(words->end(), real.begin(), real.end());
  const std::vector<Words> commands = {
      camera,
      simulate,
      serve,
      {"replay", recording, "--gige", OwnAddress(81)},
      {"import", pictures.string(), "-o", to},
      {"export", recording, "-o", to},
      {"export", recording, "-o", to, "--as", "angles"},
      {"calibrate", "dark", pictures.string(), "-o", to},
      {"calibrate", "flat", pictures.string(), "-o", to},
      {"calibrate", "apply", pictures.string(), "-o", to},
      {"check", recording},
      {"check", (pictures / "mosaic" / "0.png").string()},
      {"doctor", "--folder", folder_.path().string()},
      {"cameras", "--watch"},
  };
  Random random(11);
  for (const Words& command : commands) {
    double quickest = 1e9;
    // Twice; on a machine that is busy with other tests more often, until once it was left alone.
    for (int round = 0; round < 2 || (round < 5 && quickest >= 1); ++round) {
      fs::remove_all(out);
      Process process(Polarscan(command));
      std::this_thread::sleep_for(std::chrono::milliseconds(50 + random.Below(1500)));
      process.Signal(SIGINT);
      const auto asked = std::chrono::steady_clock::now();
      const Outcome outcome = process.Wait(30);
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - asked).count();
      quickest = std::min(quickest, seconds);
      EXPECT_LT(seconds, 4) << command[0] << outcome.err;  // other tests run beside this one
      EXPECT_LE(outcome.exit_code, 128 + SIGINT) << command[0] << outcome.err;
      EXPECT_EQ(outcome.err.find("to go on"), std::string::npos) << command[0] << outcome.err;
    }
    EXPECT_LT(quickest, 1) << fmt::format("{} {}", command[0], command[1]);
  }
}

TEST_F(CaptureProgram, AFolderWithFilesIsNotRecordedInto) {
  WriteFileAtomically(session() / "thesis.txt", "irreplaceable");
  const Outcome outcome = RunPolarscan(CaptureWords(session(), {"--frames", "1"}));
  EXPECT_EQ(outcome.exit_code, kFailed);
  EXPECT_NE(outcome.err.find(session().string()), std::string::npos) << outcome.err;
  EXPECT_EQ(ReadFile(session() / "thesis.txt"), "irreplaceable");
}

// What is asked, and words of the answer; nothing of it begins to record.
TEST_F(CaptureProgram, WhatCannotBeRecordedIsSaidWithItsCure) {
  const auto capture = [this](const Words& more) {
    Words words = {"capture", "-o", session().string()};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  const auto simulated = [&](const std::string& setting) {
    return capture({"--camera", "simulated", "--set", setting});
  };
  WriteFileAtomically(folder_ / "file", "");
  const std::vector<std::tuple<Words, int, Words>> table = {
      {capture({"--camera", "simulatet"}),
       kFailed,
       {"no such camera now", "Did you mean simulated?", "replay:SESSION"}},
      {capture({"--camera", "/dev/video99"}), kFailed, {"no such camera now", "There are "}},
      {capture({"--camera", "replay:nowhere"}), kFailed, {"nowhere"}},
      {simulated("exposur=3"), kFailed, {"Did you mean exposure?"}},
      {simulated("exposure=5000"), kFailed, {"0.001 to 1000"}},
      {simulated("exposure=much"), kFailed, {"exposure"}},
      {simulated("exposure"), kFailed, {"Name=Value"}},
      {simulated("pixel-format=Mono9"), kFailed, {"Mono9", "as in Mono12p"}},
      {capture({"--camera", "simulated", "--frames", "-1"}), kWrongUsage, {"--frames"}},
      {{"capture", "--camera", "simulated", "-o", (folder_ / "file").string()},
       kFailed,
       {"a file of this name"}},
      {CaptureWords("/proc/session", {"--frames", "1"}), kFailed, {"/proc"}},
      {{"simulate", "--gige", "192.0.2.1", "--width", "2448", "--height", "2048"},
       kFailed,
       {"not one of this machine's", "127.0.0.1"}},
      {{"simulate", "--gige", "camera"}, kFailed, {"no IPv4 address"}},
  };
  for (const auto& [words, code, parts] : table) {
    const Outcome outcome = Process(Polarscan(words)).Wait(20);
    EXPECT_EQ(outcome.exit_code, code) << words.back() << outcome.err;
    for (const std::string& part : parts)
      EXPECT_NE((outcome.err + outcome.out).find(part), std::string::npos) << part << " in " << outcome.err;
    EXPECT_FALSE(fs::exists(session())) << words.back();
  }
}

TEST_F(CaptureProgram, WhoStopsItBeforeItBeginsReadsThatThereIsNothing) {
  Words words = {"capture", "--camera", "simulated", "-o", session().string()};
  for (const char* set : {"width=2448", "height=2048"}) words.insert(words.end(), {"--set", set});
  Process process(Polarscan(words));
  std::this_thread::sleep_for(std::chrono::seconds(1));
  process.Signal(SIGINT);
  const Outcome outcome = process.Wait(30);
  EXPECT_EQ(outcome.exit_code, kFailed);
  EXPECT_NE(outcome.err.find("the recording had not begun"), std::string::npos) << outcome.err;
  EXPECT_FALSE(fs::exists(session()));
}

// Without network, if that may be: the only camera that it sees there could be that of another test.
TEST_F(CaptureProgram, WithoutACameraTheMessageNamesTheOnesThatNeedNoHardware) {
  const bool may = Process({"unshare", "--net", "true"}).Wait().exit_code == 0;
  const auto run = [may](const std::vector<std::string>& arguments) {
    std::vector<std::string> command = Polarscan(arguments);
    if (may) command.insert(command.begin(), {"unshare", "--net"});
    return Process(command).Wait();
  };
  const Outcome list = run({"--json", "cameras"});
  ASSERT_EQ(list.exit_code, kDone);
  if (nlohmann::json::parse(list.out)["cameras"].size() > 1) GTEST_SKIP() << "there is a camera";
  const Outcome outcome = run({"capture", "-o", session().string()});
  EXPECT_EQ(outcome.exit_code, kFailed);
  EXPECT_NE(outcome.err.find("--camera simulated"), std::string::npos) << outcome.err;
  EXPECT_EQ(RunPolarscan({"capture"}).exit_code, kWrongUsage);
}

// Aravis' own programs take our camera for a real one.
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

TEST_F(CaptureProgram, OverexposedRecordingsAreSaidWhileTheyAreMade) {
  for (const auto& [exposure, clips] : {std::pair("exposure=4", true), std::pair("exposure=0.5", false)}) {
    fs::remove_all(session());
    const Outcome outcome = RunPolarscan(CaptureWords(session(), {"--seconds", "2", "--set", exposure}));
    ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
    EXPECT_EQ(outcome.err.find("are clipped: less exposure") != std::string::npos, clips) << outcome.err;
  }
}

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

TEST_F(CaptureProgram, ViewsOfASessionAreThoseOfItsExportedMosaics) {
  ASSERT_EQ(RunPolarscan(CaptureWords(session(), {"--frames", "3", "--set", "fps=100"})).exit_code, kDone);
  const fs::path pictures = folder_ / "pictures";
  ASSERT_EQ(RunPolarscan({"export", session().string(), "-o", pictures.string()}).exit_code, kDone);
  EXPECT_TRUE(fs::exists(pictures / "mosaic" / "000002.tif"));
  for (const auto& [input, views] : {std::pair(session(), "a"), std::pair(pictures, "b")})
    ASSERT_EQ(RunPolarscan({"demosaic", input.string(), "-o", (folder_ / views).string()}).exit_code, kDone);
  auto a = Contents(folder_ / "a"), b = Contents(folder_ / "b");
  a.erase("views.json"), b.erase("views.json");  // hashes of the files they were made from
  EXPECT_EQ(a.size(), 6u);
  EXPECT_TRUE(a == b);
}

TEST_F(CaptureProgram, ReconstructTakesASessionAndMakesItsViews) {
  ASSERT_EQ(RunPolarscan(CaptureWords(session(), {"--frames", "3", "--set", "fps=100"})).exit_code, kDone);
  // Too small for structure from motion: what matters here is that the views are made of the session.
  RunPolarscan({"reconstruct", session().string(), "-o", (folder_ / "scan").string()},
               {{"PATH", "/nowhere"}});
  EXPECT_EQ(ReadJson(folder_ / "scan" / "scan.json")["stages"]["views"]["state"], "done");
  EXPECT_TRUE(fs::exists(folder_ / "scan" / "views" / "000002.tif"));
}

// Every call that brings something to the disk fails once, in every place: by what the system says.
TEST_F(CaptureProgram, WhateverTheSystemRefusesTheSessionIsUsableAndTheReasonIsSaid) {
  if (Process({"strace", "-qq", "true"}).Wait(20).exit_code != 0)
    GTEST_SKIP() << "there is no strace, or it may not trace here";
  const Words record =
      Polarscan(CaptureWords(session(), {"--frames", "12", "--set", "fps=200", "--sync", "0.03"}));
  std::map<int, int> ends;
  for (const auto& [call, error, reason] : {std::tuple{"writev", "ENOSPC", "disk full"},
                                            {"writev", "EIO", "Input/output"},
                                            {"writev", "EINTR", ""},
                                            {"fdatasync", "EIO", "Input/output"},
                                            {"fsync", "EIO", "Input/output"},
                                            {"write", "ENOSPC", "disk full"},
                                            {"rename", "EIO", "Input/output"},
                                            {"openat", "EMFILE", "Too many open files"}})
    for (int n = 1; n <= 5; ++n) {
      fs::remove_all(session());
      // Only on files of the session, so that the n-th call is one of the recorder's.
      const std::string where = std::string(call) + ":error=" + error + ":when=" + std::to_string(n);
      Words argv = {"strace", "-f", "-qq", "-o", "/dev/null", "-e", "inject=" + where};
      for (const char* file : {"session.json", "segments", "segments/000000.seg", "segments/000001.seg", ""})
        argv.insert(argv.end(), {"-P", (session() / file).string()});
      argv.insert(argv.end(), record.begin(), record.end());
      const Outcome outcome = Process(argv).Wait(60);
      ++ends[outcome.exit_code];
      ASSERT_TRUE(outcome.exit_code == kDone || outcome.exit_code == kFailed) << where << outcome.err;
      if (outcome.exit_code == kFailed) {
        EXPECT_NE(outcome.err.find(*reason ? reason : "never"), std::string::npos) << where << outcome.err;
      }
      if (!fs::exists(session() / "session.json")) continue;  // nothing had begun
      const Session left = OpenSession(session(), Verify::kPayloads);
      EXPECT_TRUE(left.damage.empty()) << where;
      const bool whole = outcome.exit_code == kDone;
      EXPECT_EQ(left.info.closed, whole) << where;
      EXPECT_TRUE(!whole || left.frames.size() == 12) << where;
      for (std::size_t i = 0; i < left.frames.size(); ++i)
        EXPECT_EQ(left.frames[i].info.sequence, i) << where;
    }
  EXPECT_GT(ends[kFailed], 10);
  EXPECT_GT(ends[kDone], 5);
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
