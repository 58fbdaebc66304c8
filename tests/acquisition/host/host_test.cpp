// SPDX-License-Identifier: Apache-2.0
// The host checks, on made-up /sys, /proc and /dev folders: what is of no one camera.
#include <sys/timex.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "acquisition/host/disk.h"
#include "acquisition/host/tasks.h"
#include "host/host_folders.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

TEST_F(HostTest, VideoDevicesThatAreNotMineAreNamed) {
  EXPECT_TRUE(Is(CheckVideoDevices(host_).at(0), CheckState::kNotApplicable));
  Put(host_.dev / "video0", "");
  Put(host_.dev / "video1", "");
  EXPECT_TRUE(Is(CheckVideoDevices(host_).at(0), CheckState::kGood));
  fs::permissions(host_.dev / "video1", fs::perms::none);
  WithoutPrivileges([&] {
    const Checks checks = CheckVideoDevices(host_);
    ASSERT_EQ(checks.size(), 1u);
    EXPECT_TRUE(Is(Find(checks, "video1"), CheckState::kWarning));
    EXPECT_NE(checks[0].fix.find("usermod -aG video"), std::string::npos);
  });
}

TEST_F(HostTest, OnlyTheSimulatedCameraIsNoCamera) {
  const CameraInfo simulated{"simulated", "", "", ""}, real{"Basler-4711", "", "", ""};
  EXPECT_TRUE(Is(CheckCameras({simulated}), CheckState::kNotApplicable));
  EXPECT_NE(CheckCameras({simulated}).fix.find("--camera simulated"), std::string::npos);
  EXPECT_TRUE(Is(CheckCameras({real, simulated}), CheckState::kGood));
  EXPECT_EQ(CheckCameras({real, simulated}).measured, real.id);
}

TEST_F(HostTest, LimitsAreReadAsTheKernelWritesThem) {
  const auto limits = [](const std::string& files) {
    return "Limit                     Soft Limit           Hard Limit           Units     \n"
           "Max open files            " +
           files +
           "                 1048576              files     \n"
           "Max locked memory         unlimited            unlimited            bytes     \n"
           "Max realtime priority     0                    0                    ";
  };
  EXPECT_TRUE(Is(CheckLimits(host_), CheckState::kNotApplicable));
  Put(host_.proc / "self/limits", limits("1024"));
  EXPECT_TRUE(Is(CheckLimits(host_), CheckState::kGood));
  EXPECT_EQ(CheckLimits(host_).measured, "open files 1024, locked memory unlimited, real-time priority 0");
  Put(host_.proc / "self/limits", limits("256"));
  EXPECT_TRUE(Is(CheckLimits(host_), CheckState::kWarning));
  Put(host_.proc / "self/limits", limits("unlimited"));
  EXPECT_TRUE(Is(CheckLimits(host_), CheckState::kGood));
}

TEST_F(HostTest, AClockThatNobodyKeepsIsAWarning) {
  timex clock{};
  clock.maxerror = 2400;
  EXPECT_TRUE(Is(CheckClock(TIME_OK, clock), CheckState::kGood));
  EXPECT_NE(CheckClock(TIME_OK, clock).measured.find("2 ms"), std::string::npos);
  EXPECT_TRUE(Is(CheckClock(TIME_ERROR, clock), CheckState::kWarning));
  clock.status = STA_UNSYNC;
  EXPECT_TRUE(Is(CheckClock(TIME_OK, clock), CheckState::kWarning));
  EXPECT_TRUE(Is(CheckClock(-1, clock), CheckState::kNotApplicable));
}

TEST_F(HostTest, MeasuringTheDiskLeavesNothingBehind) {
  const Progress progress;
  const Disk disk = MeasureDisk(folder_, progress);
  EXPECT_GT(disk.free, 0);
  if (disk.free < 1e9) GTEST_SKIP() << "the temporary folder has too little space to measure in";
  EXPECT_GT(disk.write_rate, 1e5);
  EXPECT_TRUE(fs::is_empty(folder_));
  Progress stop;
  stop.Cancel();
  EXPECT_THROW(MeasureDisk(folder_, stop), Cancelled);
  EXPECT_TRUE(fs::is_empty(folder_));
  EXPECT_THROW(MeasureDisk(folder_ / "missing", progress), Error);
}

TEST_F(HostTest, AFolderThatCannotBeWrittenIsSaidWithItsName) {
  fs::permissions(folder_, fs::perms(0555));
  WithoutPrivileges([&] {
    try {
      MeasureDisk(folder_, Progress());
      FAIL();
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(folder_.string()), std::string::npos) << error.what();
    }
  });
  fs::permissions(folder_, fs::perms(0755));
}

TEST(HostDisk, ADiskIsHeldAgainstTheRateOfACamera) {
  EXPECT_TRUE(Is(Find(CheckDisk("x", {50e9, 400e6}), "writing"), CheckState::kGood));
  EXPECT_TRUE(Is(Find(CheckDisk("x", {50e9, 400e6}), "free"), CheckState::kGood));
  EXPECT_TRUE(Is(Find(CheckDisk("x", {50e9, 100e6}), "writing"), CheckState::kWarning));
  EXPECT_TRUE(Is(Find(CheckDisk("x", {5e9, 400e6}), "free"), CheckState::kWarning));
  EXPECT_TRUE(Is(Find(CheckDisk("x", {1e8, 0}), "writing"), CheckState::kNotApplicable));
}

TEST(HostTasks, ChecksComeInTheOrderOfTheTasksAndAFailureIsBad) {
  const auto named = [](const std::string& name) { return Checks{{name, CheckState::kGood, "", "", ""}}; };
  const Checks checks = RunHostTasks(
      {{"slow", 10, "",
        [&](Progress&) {
          std::this_thread::sleep_for(std::chrono::milliseconds(50));
          return named("slow");
        }},
       {"broken", 10, "mend it", [](Progress&) -> Checks { throw Error("it is broken", "here"); }},
       {"quick", 10, "", [&](Progress&) { return named("quick"); }}},
      Progress());
  ASSERT_EQ(checks.size(), 3u);
  EXPECT_EQ(checks[0].name + checks[2].name, "slowquick");
  EXPECT_TRUE(Is(checks[1], CheckState::kBad));
  EXPECT_EQ(checks[1].measured, "it is broken: here");
  EXPECT_EQ(checks[1].fix, "mend it");
}

TEST(HostTasks, ATaskThatHangsIsCancelledAndReported) {
  const auto cancelled = std::make_shared<std::atomic<bool>>(false);
  const auto hang = [cancelled](Progress& progress) {
    while (!progress.cancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    *cancelled = true;
    return Checks();
  };
  const auto began = std::chrono::steady_clock::now();
  const Checks checks = RunHostTasks({{"hangs", 0.1, "", hang}}, Progress());
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(20));
  ASSERT_EQ(checks.size(), 1u);
  EXPECT_TRUE(Is(checks[0], CheckState::kWarning));
  EXPECT_TRUE(*cancelled);
}

TEST(HostTasks, ATaskThatCannotBeStoppedIsLeftAlone) {
  const auto over = std::make_shared<std::atomic<bool>>(false);
  const auto hang = [over](Progress&) {
    while (!*over) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return Checks();
  };
  EXPECT_TRUE(Is(RunHostTasks({{"hangs", 0.1, "", hang}}, Progress()).at(0), CheckState::kWarning));
  *over = true;
}

TEST(HostTasks, StoppingDoesNotWaitForThem) {
  Progress progress;
  progress.Cancel();
  const auto hang = [](Progress& own) {
    while (!own.cancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return Checks();
  };
  EXPECT_THROW(RunHostTasks({{"hangs", 600, "", hang}}, progress), Cancelled);
}

}  // namespace
}  // namespace polarscan::test
