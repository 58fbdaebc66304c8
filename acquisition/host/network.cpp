// SPDX-License-Identifier: Apache-2.0
#include "acquisition/host/network.h"

#include <fmt/format.h>
#include <linux/capability.h>
#include <net/if.h>
#include <net/if_arp.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <set>

namespace polarscan {
namespace fs = std::filesystem;
namespace {

constexpr long kLargePackets = 8000;  // bytes
constexpr long kSocketBuffer_bytes = 32 << 20;

// Interfaces that packets of IPv4 are sent to: those with an address.
std::set<std::string> InterfacesWithAddress(const Host& host) {
  std::set<std::string> names;
  std::ifstream routes(host.proc / "net/route");
  std::string line;
  std::getline(routes, line);
  while (std::getline(routes, line)) names.insert(line.substr(0, line.find('\t')));
  return names;
}

// Ethernet, not loopback, switched on, and with a cable as far as it tells.
bool IsUp(const fs::path& interface) {
  const unsigned long flags = std::strtoul(ReadLine(interface / "flags").c_str(), nullptr, 16);
  return (flags & IFF_UP) && !(flags & IFF_LOOPBACK) && ReadNumber(interface / "type", -1) == ARPHRD_ETHER &&
         ReadLine(interface / "operstate") != "down";
}

std::vector<fs::path> InterfacesUp(const Host& host, const std::set<std::string>& with_address) {
  std::vector<fs::path> up;
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(host.sys / "class/net", missing))
    if (IsUp(entry.path()) &&
        (fs::exists(entry.path() / "device") || with_address.contains(entry.path().filename())))
      up.push_back(entry.path());
  std::ranges::sort(up);
  return up;
}

HostCheck CheckAddress(const std::string& name, bool has_address) {
  HostCheck check{"network " + name + ", address", CheckState::kGood, "has one", "", ""};
  if (!has_address) {
    check.state = CheckState::kWarning;
    check.measured = "no IPv4 address";
    check.required = "one in the camera's network, for a GigE camera";
    check.fix = fmt::format("sudo ip addr add 169.254.1.1/16 dev {}", name);
  }
  return check;
}

HostCheck CheckPacketSize(const fs::path& interface, const std::string& name) {
  const long mtu = ReadNumber(interface / "mtu", 0);
  HostCheck check{"network " + name + ", packets", CheckState::kGood, fmt::format("{} bytes", mtu),
                  fmt::format("{} bytes or more, for a GigE camera", kLargePackets), ""};
  if (mtu < kLargePackets) {
    check.state = CheckState::kWarning;
    check.fix = fmt::format("sudo ip link set {} mtu 9000", name);
  }
  return check;
}

// The strict filter throws a camera's answer away if it comes from another network than the interface's. The
// kernel takes the larger of the two settings.
HostCheck CheckReversePath(const Host& host, const std::string& name) {
  const fs::path settings = host.proc / "sys/net/ipv4/conf";
  const long filter =
      std::max(ReadNumber(settings / "all/rp_filter", 0), ReadNumber(settings / name / "rp_filter", 0));
  HostCheck check{"network " + name + ", filter", CheckState::kGood, filter == 2 ? "loose" : "off", "", ""};
  if (filter == 1) {
    check.state = CheckState::kWarning;
    check.measured = "the strict reverse-path filter hides cameras of other networks";
    check.required = "loose or off, for a GigE camera";
    check.fix = fmt::format("sudo sysctl net.ipv4.conf.{}.rp_filter=2", name);
  }
  return check;
}

std::vector<HostCheck> CheckInterface(const Host& host, const fs::path& interface, bool has_address) {
  const std::string name = interface.filename();
  if (fs::exists(interface / "wireless") || fs::exists(interface / "phy80211"))
    return {{"network " + name, CheckState::kWarning, "wireless", "a cable, for a GigE camera",
             "connect the camera by cable"}};
  return {CheckAddress(name, has_address), CheckPacketSize(interface, name), CheckReversePath(host, name)};
}

// Effective capabilities of this program.
std::uint64_t Capabilities(const Host& host) {
  std::ifstream status(host.proc / "self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("CapEff:")) return std::strtoull(line.c_str() + 7, nullptr, 16);
  return 0;
}

HostCheck CheckSocketBuffer(const Host& host) {
  const long bytes = ReadNumber(host.proc / "sys/net/core/rmem_max", -1);
  HostCheck check{"network, socket buffer", CheckState::kGood, fmt::format("{} bytes", bytes),
                  fmt::format("{} bytes, for a GigE camera", kSocketBuffer_bytes), ""};
  if (bytes < 0) {
    check.state = CheckState::kNotApplicable;
    check.measured = "not known (a container does not show it)";
  } else if (Capabilities(host) >> CAP_NET_ADMIN & 1) {
    check.measured += ", but this program may have more";
  } else if (bytes < kSocketBuffer_bytes) {
    check.state = CheckState::kWarning;
    check.fix = fmt::format(
        "echo net.core.rmem_max={} | sudo tee /etc/sysctl.d/70-polarscan.conf && sudo sysctl --system",
        kSocketBuffer_bytes);
  }
  return check;
}

}  // namespace

std::vector<HostCheck> CheckNetwork(const Host& host) {
  const std::set<std::string> with_address = InterfacesWithAddress(host);
  const std::vector<fs::path> interfaces = InterfacesUp(host, with_address);
  if (interfaces.empty())
    return {{"network", CheckState::kNotApplicable, "no Ethernet interface is up", "", ""}};
  std::vector<HostCheck> checks;
  for (const fs::path& interface : interfaces) {
    const bool has_address = with_address.contains(interface.filename());
    const std::vector<HostCheck> more = CheckInterface(host, interface, has_address);
    checks.insert(checks.end(), more.begin(), more.end());
  }
  checks.push_back(CheckSocketBuffer(host));
  return checks;
}

}  // namespace polarscan
