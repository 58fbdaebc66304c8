// SPDX-License-Identifier: Apache-2.0
#include "core/files/process.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <thread>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

class Process : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "polarscan-process-XXXXXX").string();
    folder = mkdtemp(name.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  ProcessResult Shell(const std::string& script, double timeout_s = 0) {
    return RunProcess({"sh", "-c", script}, folder / "log", progress, timeout_s);
  }
  double Seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  // Whether the process whose id the script wrote to `file` is gone (or only a zombie that init will
  // collect).
  bool IsGone(const std::string& file) const {
    const pid_t pid = std::stoi(ReadFile(folder / file));
    for (int i = 0; i < 50; ++i) {
      if (kill(pid, 0) != 0) return true;
      std::error_code ignored;
      const std::filesystem::path stat = "/proc/" + std::to_string(pid) + "/stat";
      if (std::filesystem::exists(stat, ignored) && ReadFile(stat).find(") Z ") != std::string::npos)
        return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

  std::filesystem::path folder;
  Progress progress;
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
};

TEST_F(Process, TheEnvironmentIsOursWithWhatIsGivenBeforeIt) {
  ASSERT_EQ(setenv("POLARSCAN_OURS", "ours", 1), 0);
  ASSERT_EQ(setenv("POLARSCAN_BOTH", "ours", 1), 0);
  RunProcess({"sh", "-c", "echo $POLARSCAN_OURS $POLARSCAN_BOTH $POLARSCAN_NEW"}, folder / "log", progress, 0,
             {}, {}, {"POLARSCAN_BOTH=given", "POLARSCAN_NEW=new"});
  EXPECT_EQ(ReadFile(folder / "log"), "ours given new\n");
}

TEST_F(Process, AppendsBothStreamsToTheLog) {
  EXPECT_EQ(Shell("echo one; echo two >&2").exit_code, 0);
  EXPECT_EQ(Shell("echo three").exit_code, 0);
  EXPECT_EQ(ReadFile(folder / "log"), "one\ntwo\nthree\n");
}

TEST_F(Process, PassesArgumentsWithoutAShellInBetween) {
  RunProcess({"printf", "%s|", "a b", "$HOME; rm *", ""}, folder / "log", progress);
  EXPECT_EQ(ReadFile(folder / "log"), "a b|$HOME; rm *||");
}

TEST_F(Process, ReportsExitCodesAndSignals) {
  EXPECT_EQ(Shell("exit 3").exit_code, 3);
  EXPECT_EQ(Shell("kill -ABRT $$").exit_code, 128 + SIGABRT);
}

TEST_F(Process, DoesNotReadTheTerminal) { EXPECT_EQ(Shell("read line || exit 7").exit_code, 7); }

TEST_F(Process, IsKilledWithItsChildrenWhenTheUserCancels) {
  std::thread user([&] {
    while (!std::filesystem::exists(folder / "ready"))
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    start = std::chrono::steady_clock::now();
    progress.Cancel();
  });
  const std::string script =
      "cd " + folder.string() +
      "; trap '' TERM; (trap '' TERM; sh -c 'echo $$ > child; exec sleep 60') & echo $$ > leader; "
      "while [ ! -s child ]; do sleep 0.01; done; touch ready; sleep 60; sleep 60";
  EXPECT_THROW(Shell(script), Cancelled);
  user.join();
  EXPECT_LT(Seconds(), 1.0);
  EXPECT_TRUE(IsGone("leader"));
  EXPECT_TRUE(IsGone("child"));
}

TEST_F(Process, DoesNotStartWhenAlreadyCancelled) {
  progress.Cancel();
  EXPECT_THROW(Shell("touch " + (folder / "ran").string()), Cancelled);
  EXPECT_FALSE(std::filesystem::exists(folder / "ran"));
}

TEST_F(Process, IsKilledAfterItsTime) {
  const ProcessResult result = Shell("sleep 60", 0.2);
  EXPECT_TRUE(result.timed_out);
  EXPECT_LT(Seconds(), 2.0);
}

TEST_F(Process, EndsWhenTheCallbackThrows) {
  const auto fail = [] { throw Error("stop", "here"); };
  EXPECT_THROW(RunProcess({"sleep", "60"}, folder / "log", progress, 0, fail), Error);
  EXPECT_LT(Seconds(), 2.0);
}

TEST_F(Process, SaysWhenTheProgramIsMissingOrBroken) {
  EXPECT_THROW(RunProcess({"no-such-program-here"}, folder / "log", progress), Error);
  EXPECT_THROW(RunProcess({}, folder / "log", progress), Error);
  WriteFileAtomically(folder / "broken",
                      "\x7f"
                      "ELF not really");
  std::filesystem::permissions(folder / "broken", std::filesystem::perms::owner_all);
  EXPECT_THROW(RunProcess({(folder / "broken").string()}, folder / "log", progress), Error);
}

TEST_F(Process, FindsProgramsInThePathOrByTheirPath) {
  EXPECT_EQ(FindProgram("sh").filename(), "sh");
  EXPECT_EQ(FindProgram("/bin/sh"), "/bin/sh");
  EXPECT_TRUE(FindProgram("no-such-program-here").empty());
  EXPECT_TRUE(FindProgram("/bin/no-such-program-here").empty());
  EXPECT_TRUE(FindProgram("").empty());
}

}  // namespace
}  // namespace polarscan
