// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <netinet/in.h>

#include <chrono>
#include <functional>
#include <string>

#include "core/files/descriptor.h"
#include "simulation/gige/protocol.h"

namespace polarscan {

// "127.0.0.1" as the system has it. Throws Error if the text is no IPv4 address.
in_addr Ipv4Of(const std::string& text);

// The same address and port.
bool SameHost(const sockaddr_in& a, const sockaddr_in& b);

// Where GVCP commands arrive: those sent to a camera's address, and broadcast ones where they can be heard.
class ControlSockets {
 public:
  // Throws Error if the address cannot be bound: another camera is there already, it is another machine's.
  explicit ControlSockets(const in_addr& address);

  // Who asked while the camera got ready has given up.
  void ForgetOldQuestions() const;

  // Gives what arrives within `timeout` to `hear` and sends back what that answers, unless it is empty.
  using Hear = std::function<Bytes(ByteView datagram, const sockaddr_in& from)>;
  void Serve(std::chrono::milliseconds timeout, const Hear& hear) const;

 private:
  Descriptor control_, broadcast_;
};

}  // namespace polarscan
