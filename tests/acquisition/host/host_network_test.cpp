// SPDX-License-Identifier: Apache-2.0
// The checks of a host's network cards for GigE cameras, on made-up /sys and /proc folders.
#include "acquisition/host/network.h"
#include "host/host_folders.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

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

}  // namespace
}  // namespace polarscan::test
