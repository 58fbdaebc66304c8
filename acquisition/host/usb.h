// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>

#include "acquisition/host/host.h"

namespace polarscan {

// A USB3 Vision camera as it can be seen without opening it.
struct UsbCamera {
  std::string name;            // vendor, model and serial number, as far as they are known
  std::filesystem::path sys;   // its folder in sysfs
  std::filesystem::path node;  // its device file
};

// By libusb, from the descriptors that the kernel keeps; also those that this user may not open. Throws Error
// if libusb does not work here.
std::vector<UsbCamera> FindUsbCameras(const Host& host);

// Access, who holds it, link speed and autosuspend.
std::vector<HostCheck> CheckUsbCamera(const Host& host, const UsbCamera& camera);

// The memory that the kernel lends to all USB transfers together.
HostCheck CheckUsbMemory(const Host& host, std::size_t cameras);

// All of the above.
std::vector<HostCheck> CheckUsb(const Host& host);

}  // namespace polarscan
