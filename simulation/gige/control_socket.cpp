// SPDX-License-Identifier: Apache-2.0
#include "simulation/gige/control_socket.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <poll.h>
#include <sys/socket.h>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

constexpr std::size_t kLargestDatagram = 65536;

// "127.0.0.1, 192.168.0.7": those that a camera can be at.
std::string OwnAddresses() {
  std::string text;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return "127.0.0.1";
  for (const ifaddrs* i = list; i; i = i->ifa_next)
    if (i->ifa_addr && i->ifa_addr->sa_family == AF_INET)
      text += (text.empty() ? "" : ", ") +
              std::string(::inet_ntoa(reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr));
  ::freeifaddrs(list);
  return text.empty() ? "127.0.0.1" : text;
}

// A socket that hears GVCP commands sent to this address, broadcast ones too.
Descriptor ControlSocket(const in_addr& address, bool required) {
  Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const int on = 1;
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr = address;
  name.sin_port = htons(gvcp::kPort);
  if (!required) ::setsockopt(socket.fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  ::setsockopt(socket.fd, SOL_SOCKET, SO_BROADCAST, &on, sizeof on);
  if (socket.fd >= 0 && ::bind(socket.fd, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0)
    return socket;
  if (required && errno == EADDRINUSE)
    throw Error("a GigE Vision camera is there already", std::string(::inet_ntoa(address)),
                "Take another address, on this machine say 127.0.0.2");
  if (required && errno == EADDRNOTAVAIL)
    throw Error("this address is not one of this machine's", std::string(::inet_ntoa(address)),
                "It has " + OwnAddresses());
  if (required) ThrowSystemError("cannot open the camera's control socket", ::inet_ntoa(address));
  return Descriptor(-1);
}

}  // namespace

in_addr Ipv4Of(const std::string& text) {
  in_addr address{};
  if (::inet_pton(AF_INET, text.c_str(), &address) != 1)
    throw Error("this is no IPv4 address", text, "Write it as 127.0.0.1");
  return address;
}

bool SameHost(const sockaddr_in& a, const sockaddr_in& b) {
  return a.sin_addr.s_addr == b.sin_addr.s_addr && a.sin_port == b.sin_port;
}

ControlSockets::ControlSockets(const in_addr& address)
    : control_(ControlSocket(address, true)), broadcast_(ControlSocket({INADDR_BROADCAST}, false)) {}

void ControlSockets::ForgetOldQuestions() const {
  char byte = 0;
  for (const int socket : {control_.fd, broadcast_.fd})
    while (::recv(socket, &byte, 1, MSG_DONTWAIT | MSG_TRUNC) >= 0) {
    }
}

void ControlSockets::Serve(std::chrono::milliseconds timeout, const Hear& hear) const {
  pollfd sockets[] = {{control_.fd, POLLIN, 0}, {broadcast_.fd, POLLIN, 0}};
  if (::poll(sockets, 2, int(timeout.count())) <= 0) return;
  for (const pollfd& socket : sockets) {
    if (!(socket.revents & POLLIN)) continue;
    Bytes datagram(kLargestDatagram);
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t n =
        ::recvfrom(socket.fd, datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    if (n <= 0) continue;
    const Bytes answer = hear(ByteView(datagram).first(std::size_t(n)), from);
    if (!answer.empty())
      ::sendto(control_.fd, answer.data(), answer.size(), 0, reinterpret_cast<const sockaddr*>(&from), size);
  }
}

}  // namespace polarscan
