// SPDX-License-Identifier: Apache-2.0
// Recording through the program as users meet it: what is recorded, what is refused, and the way from a
// session to views.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "capture/capture_program.h"
#include "core/files/files.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

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

TEST_F(CaptureProgram, CheckReadsWhatASessionSaysOfItsSensor) {
  ASSERT_EQ(RunPolarscan(CaptureWords(session(), {"--frames", "2"})).exit_code, kDone);
  nlohmann::json info = ReadJson(session() / "session.json");
  info["sensor"]["black_dn"] = "sixty";
  WriteJson(session() / "session.json", info);
  const std::string damage = CheckJson(kDataLost)["damage"].dump();
  EXPECT_NE(damage.find("black_dn"), std::string::npos) << damage;
}

TEST_F(CaptureProgram, LostFramesAreSaidAndTheExitCodeTellsToo) {
  const Outcome outcome = RunPolarscan(
      CaptureWords(session(), {"--frames", "30", "--set", "fps=500", "--set", "frame-loss=0.3"}));
  EXPECT_EQ(outcome.exit_code, kDataLost) << outcome.err;
  EXPECT_NE(outcome.err.find("never came"), std::string::npos) << outcome.err;
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

TEST_F(CaptureProgram, OverexposedRecordingsAreSaidWhileTheyAreMade) {
  for (const auto& [exposure, clips] : {std::pair("exposure=4", true), std::pair("exposure=0.5", false)}) {
    fs::remove_all(session());
    const Outcome outcome = RunPolarscan(CaptureWords(session(), {"--seconds", "2", "--set", exposure}));
    ASSERT_EQ(outcome.exit_code, kDone) << outcome.err;
    EXPECT_EQ(outcome.err.find("are clipped: less exposure") != std::string::npos, clips) << outcome.err;
  }
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

}  // namespace
}  // namespace polarscan::test
