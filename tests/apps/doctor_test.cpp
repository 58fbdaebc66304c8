// SPDX-License-Identifier: Apache-2.0
// polarscan doctor and the udev rule, with made-up USB devices (umockdev) that libusb, Aravis and udev take
// for real ones.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "core/files/files.h"
#include "program.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

using Words = std::vector<std::string>;

// Device and configuration descriptors. The cameras have USB3 Vision's interfaces control, event and stream.
constexpr const char* kSuperSpeedCamera =
    "12012003ef020109c91f05500001010203010902600003010080fa080b0003ef0500000904000002ef050000070581020004"
    "00063000000000070501020004000630000000000904010001ef050100070582020004000630000000000904020001ef0502"
    "0007058302000400063000000000";
constexpr const char* kUsb2Camera =
    "12011002ef020140c91f05500001010203010902480003010080fa080b0003ef0500000904000002ef050000070581020002"
    "00070501020002000904010001ef050100070582020002000904020001ef05020007058302000200";
constexpr const char* kKeyboard =
    "120100020000000840413e2000010102000109022200010100a0320904000001030101000921110100012240000705810308"
    "000a";

struct UsbDevice {
  std::string place;  // in sysfs
  int bus, address, speed;
  std::string vendor, product, serial, power, descriptors;
};

const UsbDevice kFast = {"usb2/2-1", 2, 2, 5000, "LUCID", "PHX050S", "2014", "on", kSuperSpeedCamera};
const UsbDevice kSlow = {"usb1/1-2", 1, 3, 480, "FLIR", "BFS-U3", "1977", "auto", kUsb2Camera};
const UsbDevice kKeys = {"usb1/1-3", 1, 4, 12, "Some", "Keyboard", "1", "auto", kKeyboard};

// As umockdev-record writes it.
std::string Description(const UsbDevice& d) {
  const std::string node = fmt::format("bus/usb/{:03}/{:03}", d.bus, d.address);
  std::string text = fmt::format("P: /devices/pci0/{}\nN: {}\n", d.place, node);
  for (const std::string& property :
       {std::string("SUBSYSTEM=usb"), std::string("DEVTYPE=usb_device"), "DEVNAME=/dev/" + node,
        fmt::format("BUSNUM={:03}", d.bus), fmt::format("DEVNUM={:03}", d.address)})
    text += "E: " + property + "\n";
  for (const std::string& attribute :
       {fmt::format("busnum={}", d.bus), fmt::format("devnum={}", d.address),
        fmt::format("speed={}", d.speed), "manufacturer=" + d.vendor, "product=" + d.product,
        "serial=" + d.serial, "power/control=" + d.power, std::string("bConfigurationValue=1"),
        std::string("idVendor=1fc9"), std::string("idProduct=5005")})
    text += "A: " + attribute + "\\n\n";
  return text + "H: descriptors=" + d.descriptors + "\n\n";
}

class Doctor : public testing::Test {
 protected:
  void SetUp() override {
    WriteFileAtomically(folder_ / "devices", Description(kFast) + Description(kSlow) + Description(kKeys));
  }
  // What a shell says where the devices above are plugged in. "$0" is this test's folder.
  Outcome RunWithDevices(const std::string& script) const {
    const Words argv = {"umockdev-run", "-d",   (folder_ / "devices").string(), "--", "sh",
                        "-c",           script, folder_.path().string()};
    // The sanitizer wants to be loaded first, but umockdev is.
    return Process(argv, {{"ASAN_OPTIONS", "verify_asan_link_order=0:detect_leaks=0"}}).Wait();
  }
  static nlohmann::json Checks(const Outcome& outcome) {
    nlohmann::json checks;
    const nlohmann::json result = nlohmann::json::parse(outcome.out);
    for (const nlohmann::json& check : result.at("checks"))
      checks[check.at("name").get<std::string>()] = check;
    return checks;
  }
  TemporaryFolder folder_;
};

TEST_F(Doctor, LooksEverywhereLeavesNothingAndItsExitCodeIsItsVerdict) {
  const fs::path here = folder_ / "recordings";
  fs::create_directory(here);
  const Outcome outcome = RunPolarscan({"--json", "doctor", "--folder", here.string()});
  const nlohmann::json result = nlohmann::json::parse(outcome.out);
  std::size_t bad = 0;
  for (const nlohmann::json& check : result.at("checks")) {
    bad += check.at("state") == "bad";
    EXPECT_NE(check.at("measured"), "") << check;
    const bool is_wrong = check.at("state") == "bad" || check.at("state") == "warning";
    EXPECT_TRUE(check.at("state") == "not applicable" || is_wrong == (check.at("fix") != "")) << check;
  }
  EXPECT_EQ(result.at("bad"), bad);
  EXPECT_EQ(result.at("ready"), bad == 0);
  EXPECT_EQ(outcome.exit_code, bad == 0 ? kDone : kFailed);
  EXPECT_TRUE(fs::is_empty(here));
  const nlohmann::json checks = Checks(outcome);
  for (const char* name : {"cameras", "disk, free", "disk, writing", "limits", "clock", "COLMAP"})
    EXPECT_TRUE(checks.contains(name)) << name;
}

TEST_F(Doctor, WithoutColmapIsNotReadyAndSaysHowToGetIt) {
  const Outcome outcome =
      RunPolarscan({"doctor", "--folder", folder_.path().string()}, {{"PATH", folder_.path().string()}});
  EXPECT_EQ(outcome.exit_code, kFailed);
  EXPECT_NE(outcome.err.find("bad      COLMAP"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("fix: sudo apt install colmap"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("not ready: "), std::string::npos) << outcome.err;
}

TEST_F(Doctor, AFolderThatIsNotThereIsWrongUsage) {
  EXPECT_EQ(RunPolarscan({"doctor", "--folder", (folder_ / "missing").string()}).exit_code, kWrongUsage);
}

TEST_F(Doctor, UsbCamerasAreSeenWithTheirLinkAndNothingElseIsACamera) {
  if (!HasProgram("umockdev-run")) GTEST_SKIP() << "umockdev-run is not installed (umockdev)";
  const Outcome outcome = RunWithDevices(POLARSCAN_PROGRAM " --json doctor --folder \"$0\"");
  const nlohmann::json checks = Checks(outcome);
  EXPECT_EQ(checks.at("USB camera LUCID PHX050S 2014, access").at("state"), "good");
  EXPECT_EQ(checks.at("USB camera LUCID PHX050S 2014, link").at("state"), "good");
  EXPECT_EQ(checks.at("USB camera LUCID PHX050S 2014, power").at("state"), "good");
  EXPECT_EQ(checks.at("USB camera FLIR BFS-U3 1977, access").at("state"), "good");
  EXPECT_EQ(checks.at("USB camera FLIR BFS-U3 1977, link").at("state"), "warning");
  EXPECT_EQ(checks.at("USB camera FLIR BFS-U3 1977, power").at("state"), "warning");
  for (const auto& [name, check] : checks.items()) EXPECT_EQ(name.find("Keyboard"), std::string::npos);
}

TEST_F(Doctor, AUsbCameraThatIsNotMineMakesTheHostNotReady) {
  if (!HasProgram("umockdev-run")) GTEST_SKIP() << "umockdev-run is not installed (umockdev)";
  // Root may use every device, so it gives up what makes it root.
  const std::string as_user = ::geteuid() == 0 ? "setpriv --inh-caps=-all --bounding-set=-all " : "";
  const Outcome outcome = RunWithDevices("chmod 0 \"$UMOCKDEV_DIR/dev/bus/usb/002/002\"; exec " + as_user +
                                         POLARSCAN_PROGRAM " --json doctor --folder \"$0\"");
  if (outcome.err.find("setpriv") != std::string::npos) GTEST_SKIP() << outcome.err;
  EXPECT_EQ(outcome.exit_code, kFailed);
  const nlohmann::json checks = Checks(outcome);
  const nlohmann::json& access = checks.at("USB camera LUCID PHX050S 2014, access");
  EXPECT_EQ(access.at("state"), "bad");
  EXPECT_NE(access.at("fix").get<std::string>().find("70-polarscan.rules"), std::string::npos) << access;
  EXPECT_EQ(checks.at("USB camera FLIR BFS-U3 1977, access").at("state"), "good");
}

// What udev itself makes of our rule: in a mount namespace where it is alone with the lines that list a
// device's interfaces and that give devices to the seat.
class UdevRule : public Doctor {
 protected:
  void SetUp() override {
    Doctor::SetUp();
    WriteFileAtomically(folder_ / "rules/50-interfaces.rules",
                        "SUBSYSTEM==\"usb\", IMPORT{builtin}=\"usb_id\"\n");
    WriteFileAtomically(folder_ / "rules/73-seat-late.rules",
                        "TAG==\"uaccess\", RUN{builtin}+=\"uaccess\"\n");
    // Beside the program, where doctor looks for it.
    fs::copy(fs::path(POLARSCAN_PROGRAM).parent_path().parent_path() / "lib/udev/rules.d", folder_ / "rules");
  }
  // "" if this system does not let us.
  std::string TestRules(const UsbDevice& device) const {
    const std::string script =
        "PATH=$PATH:/usr/sbin:/sbin; "
        "for folder in /usr/lib/udev/rules.d /run; do mount -t tmpfs tmpfs $folder || exit 77; done; "
        "cp \"$0\"/rules/* /usr/lib/udev/rules.d/ && "
        "exec umockdev-run -d \"$0/devices\" -- udevadm test /sys/devices/pci0/" +
        device.place + " 2>&1";
    const Outcome outcome =
        Process({"unshare", "--map-root-user", "--mount", "sh", "-c", script, folder_.path().string()})
            .Wait();
    return outcome.exit_code == 77 || outcome.err.find("unshare") == 0 ? "" : outcome.out;
  }
  static bool HasUdevadm() { return HasProgram("udevadm") || HasProgram("/sbin/udevadm"); }
};

TEST_F(UdevRule, GivesCamerasToTheirUsersAndTouchesNothingElse) {
  if (!HasUdevadm()) GTEST_SKIP() << "udevadm is not installed (udev)";
  for (const char* program : {"umockdev-run", "unshare"})
    if (!HasProgram(program)) GTEST_SKIP() << program << " is not installed";
  const std::string camera = TestRules(kSlow), keyboard = TestRules(kKeys);
  if (camera.empty()) GTEST_SKIP() << "this system does not let us mount a file system of our own";
  ASSERT_NE(camera.find("ID_USB_INTERFACES=:ef0500:"), std::string::npos) << camera;
  for (const char* effect : {"MODE 0660", "GROUP ", "power/control' writing 'on'", "run: 'uaccess'"})
    EXPECT_NE(camera.find(effect), std::string::npos) << effect << "\n" << camera;
  ASSERT_NE(keyboard.find("ID_USB_INTERFACES=:030101:"), std::string::npos) << keyboard;
  for (const char* effect : {"MODE ", "GROUP ", "writing", "run: 'uaccess'"})
    EXPECT_EQ(keyboard.find(effect), std::string::npos) << effect << "\n" << keyboard;
}

}  // namespace
}  // namespace polarscan::test
