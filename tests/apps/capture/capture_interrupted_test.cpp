// SPDX-License-Identifier: Apache-2.0
// Recordings that do not end as they should: Ctrl-C, kill -9, a full disk, damage, and whatever the system
// refuses.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <map>
#include <thread>

#include "acquisition/session/session_reader.h"
#include "capture/capture_program.h"
#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "core/random.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

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

}  // namespace
}  // namespace polarscan::test
