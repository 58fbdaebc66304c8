// SPDX-License-Identifier: Apache-2.0
#include "acquisition/host/usb.h"

#include <fmt/format.h>
#include <grp.h>
#include <libusb.h>
#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <memory>

#include "core/error.h"

namespace polarscan {
namespace fs = std::filesystem;
namespace {

constexpr int kSuperSpeed = 5000;    // Mbit/s
constexpr int kUsbMemory_mb = 1000;  // what camera makers ask for
constexpr const char* kRule = "70-polarscan.rules";
constexpr const char* kReloadRules =
    "sudo udevadm control --reload && sudo udevadm trigger --subsystem-match=usb";

class UsbDevices {
 public:
  UsbDevices() {
    if (const int code = libusb_init(&context_); code != 0)
      throw Error(fmt::format("USB devices cannot be listed ({})", libusb_strerror(libusb_error(code))),
                  "libusb");
    count_ = libusb_get_device_list(context_, &list_);
  }
  UsbDevices(const UsbDevices&) = delete;
  ~UsbDevices() {
    if (list_) libusb_free_device_list(list_, 1);
    libusb_exit(context_);
  }
  libusb_device** begin() const { return list_; }
  libusb_device** end() const { return list_ + std::max<ssize_t>(count_, 0); }

 private:
  libusb_context* context_ = nullptr;
  libusb_device** list_ = nullptr;
  ssize_t count_ = 0;
};

// USB3 Vision: a composite device with an interface "miscellaneous, USB3 Vision, control".
bool IsUsb3Vision(libusb_device* device) {
  libusb_device_descriptor descriptor;
  if (libusb_get_device_descriptor(device, &descriptor) != 0) return false;
  if (descriptor.bDeviceClass != 0xef || descriptor.bDeviceSubClass != 2 || descriptor.bDeviceProtocol != 1)
    return false;
  libusb_config_descriptor* read = nullptr;
  if (libusb_get_config_descriptor(device, 0, &read) != 0) return false;
  const std::unique_ptr<libusb_config_descriptor, void (*)(libusb_config_descriptor*)> config(
      read, libusb_free_config_descriptor);
  for (int i = 0; i < config->bNumInterfaces; ++i) {
    const libusb_interface& interface = config->interface[i];
    for (int k = 0; k < interface.num_altsetting; ++k) {
      const libusb_interface_descriptor& d = interface.altsetting[k];
      if (d.bInterfaceClass == 0xef && d.bInterfaceSubClass == 5 && d.bInterfaceProtocol == 0) return true;
    }
  }
  return false;
}

// "" if sysfs does not have the device.
fs::path SysFolder(const Host& host, int bus, int address) {
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(host.sys / "bus/usb/devices", missing))
    if (ReadNumber(entry.path() / "busnum", -1) == bus && ReadNumber(entry.path() / "devnum", -1) == address)
      return entry.path();
  return {};
}

std::string NameOf(const fs::path& sys, int bus, int address) {
  std::string name;
  for (const char* part : {"manufacturer", "product", "serial"})
    if (const std::string text = ReadLine(sys / part); !text.empty())
      name += (name.empty() ? "" : " ") + text;
  return name.empty() ? fmt::format("{:03}:{:03}", bus, address) : name;
}

// The rule as it came with this program: beside its folder, built or installed.
fs::path RuleOfThisProgram(const Host& host) {
  const fs::path beside = RunningProgram(host).parent_path().parent_path() / "lib/udev/rules.d" / kRule;
  return fs::exists(beside) ? beside : fs::path("udev") / kRule;
}

bool RuleIsInstalled(const Host& host) {
  std::error_code unreadable;
  for (const fs::path& folder : host.rules)
    if (fs::exists(folder / kRule, unreadable)) return true;
  return false;
}

// The group, other than root, that may read and write the device; "" if there is none.
std::string GroupOf(const fs::path& node) {
  struct stat status {};
  if (::stat(node.c_str(), &status) != 0 || (status.st_mode & 060) != 060 || status.st_gid == 0) return "";
  const group* entry = ::getgrgid(status.st_gid);
  return entry ? entry->gr_name : "";
}

std::string AccessFix(const Host& host, const fs::path& node) {
  if (const std::string group = GroupOf(node); !group.empty())
    return fmt::format("sudo usermod -aG {} $USER   (then log out and in again)", group);
  if (RuleIsInstalled(host)) return fmt::format("{}   (or unplug it and plug it in again)", kReloadRules);
  return fmt::format("sudo cp {} /etc/udev/rules.d/ && {}", Quoted(RuleOfThisProgram(host)), kReloadRules);
}

HostCheck CheckAccess(const Host& host, const UsbCamera& camera, const std::string& name) {
  HostCheck check{name + ", access", CheckState::kGood, "yours to read and write", "", ""};
  if (!MayUse(camera.node)) {
    check.state = CheckState::kBad;
    check.measured = fmt::format("seen, but {} is not yours to use", camera.node.string());
    check.required = "to read and write it";
    check.fix = AccessFix(host, camera.node);
  }
  return check;
}

HostCheck CheckLink(const UsbCamera& camera, const std::string& name) {
  const long speed = ReadNumber(camera.sys / "speed", 0);
  HostCheck check{name + ", link", CheckState::kGood, fmt::format("{} Mbit/s", speed), "5000 Mbit/s (USB 3)",
                  ""};
  if (speed <= 0) {
    check.state = CheckState::kNotApplicable;
    check.measured = "not known";
  } else if (speed < kSuperSpeed) {
    check.state = CheckState::kWarning;
    check.measured += ", a USB 2 link: at most about 40 MB/s, 5 frames/s of 5 MP";
    check.fix = "plug it into a USB 3 port, with a USB 3 cable, without a hub";
  }
  return check;
}

HostCheck CheckAutosuspend(const UsbCamera& camera, const std::string& name) {
  const fs::path control = camera.sys / "power/control";
  HostCheck check{name + ", power", CheckState::kGood, "always on", "", ""};
  if (ReadLine(control) == "auto") {
    check.state = CheckState::kWarning;
    check.measured = "the kernel may put it to sleep";
    check.required = "always on";
    check.fix = fmt::format("echo on | sudo tee {}", Quoted(control));
  }
  return check;
}

// The driver of the camera's first interface that has one; "usbfs" is a program that uses libusb.
std::string DriverOf(const fs::path& sys) {
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(sys, missing)) {
    const fs::path driver = fs::read_symlink(entry.path() / "driver", missing);
    if (entry.path().filename().string().starts_with(sys.filename().string() + ":") && !driver.empty())
      return driver.filename();
  }
  return "";
}

bool HasOpen(const fs::path& process, const fs::path& node) {
  std::error_code unreadable;
  for (const auto& entry : fs::directory_iterator(process / "fd", unreadable))
    if (fs::read_symlink(entry.path(), unreadable) == node) return true;
  return false;
}

// The folder in /proc of the program that has the device open; "" if it is not known (only root sees the
// programs of other users).
fs::path ProgramThatHolds(const Host& host, const fs::path& node) {
  std::error_code unreadable;
  for (const auto& process : fs::directory_iterator(host.proc, unreadable))
    if (std::isdigit(process.path().filename().string()[0]) && HasOpen(process.path(), node))
      return process.path();
  return {};
}

HostCheck CheckHolder(const Host& host, const UsbCamera& camera, const std::string& name) {
  HostCheck check{name + ", in use", CheckState::kGood, "by nobody", "", ""};
  const std::string driver = DriverOf(camera.sys);
  if (driver.empty()) return check;
  check.required = "by nobody";
  if (driver == "usbfs") {
    const fs::path program = ProgramThatHolds(host, camera.node);
    check.state = CheckState::kBad;
    check.measured = "by another program";
    check.fix = fmt::format("sudo fuser -v {}   (names it; then end it)", camera.node.string());
    if (!program.empty()) {
      check.measured = fmt::format("by the program {}", ReadLine(program / "comm"));
      check.fix = fmt::format("kill {}", program.filename().string());
    }
  } else {
    check.state = CheckState::kWarning;
    check.measured = fmt::format("by the kernel's driver {}", driver);
    check.fix = fmt::format("sudo modprobe -r {}", driver);
  }
  return check;
}

}  // namespace

std::vector<UsbCamera> FindUsbCameras(const Host& host) {
  std::vector<UsbCamera> cameras;
  for (libusb_device* device : UsbDevices()) {
    if (!IsUsb3Vision(device)) continue;
    const int bus = libusb_get_bus_number(device), address = libusb_get_device_address(device);
    const fs::path sys = SysFolder(host, bus, address);
    cameras.push_back(
        {NameOf(sys, bus, address), sys, host.dev / fmt::format("bus/usb/{:03}/{:03}", bus, address)});
  }
  return cameras;
}

std::vector<HostCheck> CheckUsbCamera(const Host& host, const UsbCamera& camera) {
  const std::string name = "USB camera " + camera.name;
  return {CheckAccess(host, camera, name), CheckHolder(host, camera, name), CheckLink(camera, name),
          CheckAutosuspend(camera, name)};
}

HostCheck CheckUsbMemory(const Host& host, std::size_t cameras) {
  const fs::path path = host.sys / "module/usbcore/parameters/usbfs_memory_mb";
  const long memory = ReadNumber(path, -1);
  HostCheck check{"USB memory", CheckState::kGood, fmt::format("{} MB for all cameras", memory),
                  fmt::format("{} MB", kUsbMemory_mb), ""};
  if (memory == 0) check.measured = "no limit";
  if (memory < 0) check.measured = "not known";
  if (cameras == 0 || memory < 0) {
    check.state = CheckState::kNotApplicable;
  } else if (memory > 0 && memory < kUsbMemory_mb) {
    check.state = CheckState::kWarning;
    check.fix = fmt::format("echo {} | sudo tee {}", kUsbMemory_mb, path.string());
  }
  return check;
}

std::vector<HostCheck> CheckUsb(const Host& host) {
  if (!fs::exists(host.sys / "bus/usb"))
    return {{"USB cameras", CheckState::kNotApplicable, "the kernel shows no USB here", "", ""}};
  const std::vector<UsbCamera> cameras = FindUsbCameras(host);
  std::vector<HostCheck> checks;
  if (cameras.empty())
    checks.push_back(
        {"USB cameras", CheckState::kNotApplicable, "no USB3 Vision camera is plugged in", "", ""});
  for (const UsbCamera& camera : cameras) {
    const std::vector<HostCheck> more = CheckUsbCamera(host, camera);
    checks.insert(checks.end(), more.begin(), more.end());
  }
  checks.push_back(CheckUsbMemory(host, cameras.size()));
  return checks;
}

}  // namespace polarscan
