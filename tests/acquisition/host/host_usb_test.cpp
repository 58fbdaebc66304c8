// SPDX-License-Identifier: Apache-2.0
// The checks of a host's USB cameras, on made-up /sys, /proc and /dev folders.
#include "acquisition/host/usb.h"
#include "host/host_folders.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

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

}  // namespace
}  // namespace polarscan::test
