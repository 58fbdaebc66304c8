// SPDX-License-Identifier: Apache-2.0
// The host checks, on made-up /sys, /proc and /dev folders.
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sys/syscall.h>
#include <sys/timex.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

#include "acquisition/host/disk.h"
#include "acquisition/host/network.h"
#include "acquisition/host/system.h"
#include "acquisition/host/tasks.h"
#include "acquisition/host/usb.h"
#include "session_helpers.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

using Checks = std::vector<HostCheck>;

class HostTest : public SessionFolder {
 protected:
  HostTest() { host_ = {folder_ / "sys", folder_ / "proc", folder_ / "dev", {folder_ / "rules"}}; }

  static void Put(const fs::path& path, const std::string& text) {
    fs::create_directories(path.parent_path());
    Overwrite(path, text + "\n");
  }
  static void Link(const fs::path& path, const fs::path& target) {
    fs::create_directories(path.parent_path());
    fs::create_symlink(target, path);
  }

  Host host_;
};

// The check whose name ends like this; a check named "(none)" if there is none.
HostCheck Find(const Checks& checks, const std::string& end) {
  for (const HostCheck& check : checks)
    if (check.name.ends_with(end)) return check;
  return {"(none)", CheckState::kGood, "", "", ""};
}

testing::AssertionResult Is(const HostCheck& check, CheckState state) {
  if (check.name != "(none)" && check.state == state) return testing::AssertionSuccess();
  return testing::AssertionFailure() << ToJson(check).dump(2);
}

// As a user whom the mode of a file stops, which it does not for root.
void WithoutPrivileges(const std::function<void()>& f) {
  std::thread([&] {
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct none[2] = {};
    ASSERT_EQ(::syscall(SYS_capset, &header, none), 0);
    f();
  }).join();
}

class UsbTest : public HostTest {
 protected:
  UsbTest() {
    camera_ = {"LUCID PHX050S 2014", host_.sys / "bus/usb/devices/2-1", host_.dev / "bus/usb/002/003"};
    Put(camera_.node, "");
    Put(camera_.sys / "speed", "5000");
    Put(camera_.sys / "power/control", "on");
  }
  HostCheck Check(const std::string& end) const { return Find(CheckUsbCamera(host_, camera_), end); }

  UsbCamera camera_;
};

TEST_F(UsbTest, ACameraAtItsBestIsGood) {
  for (const HostCheck& check : CheckUsbCamera(host_, camera_)) {
    EXPECT_TRUE(Is(check, CheckState::kGood));
    EXPECT_EQ(check.fix, "");
    EXPECT_NE(check.name.find(camera_.name), std::string::npos) << check.name;
  }
}

TEST_F(UsbTest, ACameraThatIsNotMineIsBadAndTheFixInstallsTheRule) {
  fs::permissions(camera_.node, fs::perms::none);
  Link(host_.proc / "self/exe", folder_ / "program's/bin/polarscan");
  Put(folder_ / "program's/lib/udev/rules.d/70-polarscan.rules", "");
  WithoutPrivileges([&] {
    const HostCheck check = Check("access");
    EXPECT_TRUE(Is(check, CheckState::kBad));
    const std::string rule = (folder_ / "program'\\''s/lib/udev/rules.d/70-polarscan.rules").string();
    EXPECT_EQ(check.fix.find("sudo cp '" + rule + "' /etc/udev/rules.d/ && sudo udevadm"), 0u) << check.fix;
  });
}

TEST_F(UsbTest, ARuleThatIsInstalledButNotYetReadIsReadAgain) {
  fs::permissions(camera_.node, fs::perms::none);
  Put(host_.rules[0] / "70-polarscan.rules", "");
  WithoutPrivileges([&] { EXPECT_EQ(Check("access").fix.find("sudo udevadm control --reload"), 0u); });
}

TEST_F(UsbTest, AUserOutsideOfTheCamerasGroupIsToldToJoinIt) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a file to a group";
  constexpr gid_t kDaemon = 1;  // of every Debian
  ASSERT_EQ(::chown(camera_.node.c_str(), 0, kDaemon), 0);
  fs::permissions(camera_.node, fs::perms(0060));
  WithoutPrivileges([&] {
    const HostCheck check = Check("access");
    EXPECT_TRUE(Is(check, CheckState::kBad));
    EXPECT_EQ(check.fix.find("sudo usermod -aG daemon $USER"), 0u) << check.fix;
  });
}

TEST_F(UsbTest, AUsb2LinkIsAWarningAndAnUnknownOneIsNot) {
  Put(camera_.sys / "speed", "480");
  EXPECT_TRUE(Is(Check("link"), CheckState::kWarning));
  Put(camera_.sys / "speed", "20000");
  EXPECT_TRUE(Is(Check("link"), CheckState::kGood));
  fs::remove(camera_.sys / "speed");
  EXPECT_TRUE(Is(Check("link"), CheckState::kNotApplicable));
}

TEST_F(UsbTest, AutosuspendIsAWarning) {
  Put(camera_.sys / "power/control", "auto");
  const HostCheck check = Check("power");
  EXPECT_TRUE(Is(check, CheckState::kWarning));
  EXPECT_NE(check.fix.find((camera_.sys / "power/control").string()), std::string::npos) << check.fix;
}

TEST_F(UsbTest, TheProgramThatHoldsTheCameraIsNamed) {
  Link(camera_.sys / "2-1:1.0/driver", "/sys/bus/usb/drivers/usbfs");
  EXPECT_TRUE(Is(Check("in use"), CheckState::kBad));
  EXPECT_NE(Check("in use").fix.find("fuser"), std::string::npos);
  Put(host_.proc / "4711/comm", "arv-viewer");
  Link(host_.proc / "4711/fd/7", camera_.node);
  Link(host_.proc / "812/fd/7", "/dev/null");
  const HostCheck check = Check("in use");
  EXPECT_TRUE(Is(check, CheckState::kBad));
  EXPECT_NE(check.measured.find("arv-viewer"), std::string::npos) << check.measured;
  EXPECT_EQ(check.fix, "kill 4711");
}

TEST_F(UsbTest, AKernelDriverThatHoldsTheCameraIsAWarning) {
  Link(camera_.sys / "2-1:1.0/driver", "/sys/bus/usb/drivers/uvcvideo");
  const HostCheck check = Check("in use");
  EXPECT_TRUE(Is(check, CheckState::kWarning));
  EXPECT_EQ(check.fix, "sudo modprobe -r uvcvideo");
}

TEST_F(UsbTest, LittleUsbMemoryMattersOnlyWhereThereIsACamera) {
  const fs::path path = host_.sys / "module/usbcore/parameters/usbfs_memory_mb";
  EXPECT_TRUE(Is(CheckUsbMemory(host_, 1), CheckState::kNotApplicable));
  Put(path, "16");
  EXPECT_TRUE(Is(CheckUsbMemory(host_, 0), CheckState::kNotApplicable));
  EXPECT_TRUE(Is(CheckUsbMemory(host_, 1), CheckState::kWarning));
  for (const char* enough : {"1000", "0"}) {  // 0: no limit
    Put(path, enough);
    EXPECT_TRUE(Is(CheckUsbMemory(host_, 1), CheckState::kGood));
  }
}

TEST_F(HostTest, AHostWithoutUsbIsNotAskedForAny) {
  const Checks checks = CheckUsb(host_);
  ASSERT_EQ(checks.size(), 1u);
  EXPECT_TRUE(Is(checks[0], CheckState::kNotApplicable));
}

class NetworkTest : public HostTest {
 protected:
  NetworkTest() {
    Put(host_.proc / "sys/net/core/rmem_max", "33554432");
    Put(host_.proc / "self/status", "Name:\tx\nCapEff:\t0000000000000000");
    AddInterface("lo", "0x9", "unknown", 772, "65536");
  }
  fs::path Interface(const std::string& name) const { return host_.sys / "class/net" / name; }
  void AddInterface(const std::string& name, const std::string& flags, const std::string& state, int type,
                    const std::string& mtu) {
    Put(Interface(name) / "flags", flags);
    Put(Interface(name) / "operstate", state);
    Put(Interface(name) / "type", std::to_string(type));
    Put(Interface(name) / "mtu", mtu);
    Put(host_.proc / "sys/net/ipv4/conf" / name / "rp_filter", "0");
  }
  // A network card with a cable.
  void AddCard(const std::string& name, const std::string& mtu = "9000") {
    AddInterface(name, "0x1003", "up", 1, mtu);
    Put(Interface(name) / "device/vendor", "0x8086");
  }
  void GiveAddresses(const std::vector<std::string>& names) {
    std::string text = "Iface\tDestination\tGateway";
    for (const std::string& name : names) text += "\n" + name + "\t0000FEA9\t00000000";
    Put(host_.proc / "net/route", text);
  }
  HostCheck Check(const std::string& end) const { return Find(CheckNetwork(host_), end); }
};

TEST_F(NetworkTest, AHostMadeForGigeCamerasHasNothingToFix) {
  AddCard("enp3s0");
  GiveAddresses({"enp3s0"});
  const Checks checks = CheckNetwork(host_);
  EXPECT_EQ(checks.size(), 4u);
  for (const HostCheck& check : checks) {
    EXPECT_EQ(check.fix, "") << check.name;
    EXPECT_EQ(check.state, CheckState::kGood) << check.name;
  }
}

TEST_F(NetworkTest, OnlyInterfacesThatAreUpAndCouldLeadToACameraAreLookedAt) {
  EXPECT_TRUE(Is(Check("network"), CheckState::kNotApplicable));
  AddInterface("ifb0", "0x82", "down", 1, "1500");
  AddInterface("eth1", "0x1003", "down", 1, "1500");         // no cable
  AddInterface("tun0", "0x10d1", "unknown", 65534, "1500");  // not Ethernet
  AddInterface("veth1", "0x1003", "up", 1, "1500");          // neither hardware nor an address
  GiveAddresses({"tun0"});
  EXPECT_TRUE(Is(Check("network"), CheckState::kNotApplicable));
  GiveAddresses({"tun0", "veth1"});
  EXPECT_TRUE(Is(Check("veth1, packets"), CheckState::kWarning));
}

TEST_F(NetworkTest, SmallPacketsAreAWarningWithTheCommandThatEnlargesThem) {
  AddCard("eth0", "1500");
  AddCard("eth1", "8000");
  GiveAddresses({"eth0", "eth1"});
  EXPECT_TRUE(Is(Check("eth0, packets"), CheckState::kWarning));
  EXPECT_EQ(Check("eth0, packets").fix, "sudo ip link set eth0 mtu 9000");
  EXPECT_TRUE(Is(Check("eth1, packets"), CheckState::kGood));
}

TEST_F(NetworkTest, ACardWithoutAnAddressIsAWarning) {
  AddCard("eth0");
  AddCard("eth1");
  GiveAddresses({"eth0"});
  EXPECT_TRUE(Is(Check("eth0, address"), CheckState::kGood));
  EXPECT_TRUE(Is(Check("eth1, address"), CheckState::kWarning));
}

TEST_F(NetworkTest, AWirelessCardIsOneWarning) {
  AddCard("wlan0", "1500");
  fs::create_directory(Interface("wlan0") / "wireless");
  GiveAddresses({"wlan0"});
  EXPECT_TRUE(Is(Check("network wlan0"), CheckState::kWarning));
  EXPECT_EQ(Check("wlan0, packets").name, "(none)");
}

TEST_F(NetworkTest, TheStrictFilterIsAWarningUnlessTheLooseOneIsOver) {
  AddCard("eth0");
  GiveAddresses({"eth0"});
  Put(host_.proc / "sys/net/ipv4/conf/all/rp_filter", "1");
  EXPECT_TRUE(Is(Check("eth0, filter"), CheckState::kWarning));
  Put(host_.proc / "sys/net/ipv4/conf/eth0/rp_filter", "2");
  EXPECT_TRUE(Is(Check("eth0, filter"), CheckState::kGood));
}

TEST_F(NetworkTest, ASmallSocketBufferIsAWarningUnlessTheProgramMayHaveMore) {
  AddCard("eth0");
  GiveAddresses({"eth0"});
  Put(host_.proc / "sys/net/core/rmem_max", "212992");
  EXPECT_TRUE(Is(Check("socket buffer"), CheckState::kWarning));
  EXPECT_NE(Check("socket buffer").fix.find("net.core.rmem_max=33554432"), std::string::npos);
  Put(host_.proc / "self/status", "CapEff:\t0000000000001000");
  EXPECT_TRUE(Is(Check("socket buffer"), CheckState::kGood));
  fs::remove(host_.proc / "sys/net/core/rmem_max");
  EXPECT_TRUE(Is(Check("socket buffer"), CheckState::kNotApplicable));
}

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
