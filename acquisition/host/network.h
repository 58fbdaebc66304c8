// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/host/host.h"

namespace polarscan {

// What a GigE Vision camera needs: of each Ethernet interface that is up its address, packet size,
// reverse-path filter and whether it is wireless; then the socket buffer.
// Interfaces without hardware (bridges, containers) count only if they have an IPv4 address.
std::vector<HostCheck> CheckNetwork(const Host& host);

}  // namespace polarscan
