// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <netinet/in.h>

#include <chrono>
#include <deque>
#include <memory>
#include <mutex>

#include "core/files/descriptor.h"
#include "core/random.h"
#include "simulation/gige/gige_server.h"
#include "simulation/gige/protocol.h"

namespace polarscan {

// A frame cut into packets for one receiver.
struct OutgoingFrame {
  gvsp::Image image;
  std::shared_ptr<const Bytes> payload;
  std::size_t packet_size = 1400;  // bytes, as GevSCPSPacketSize
  sockaddr_in receiver{};
  bool headless = false;  // its leader is never sent
};

// Sends frames as GVSP packets, loses and doubles some of them as the faults say, and keeps the last frames
// to send parts again. Send belongs to one thread, Resend to another.
class StreamSender {
 public:
  StreamSender(const in_addr& from, const GigeServerOptions& options);

  // Takes about `duration` for it.
  void Send(const OutgoingFrame& frame, std::chrono::nanoseconds duration);
  void Resend(const gvcp::Resend& request);
  // A packet of `packet_size` bytes on the wire with nothing in it.
  void SendTest(const sockaddr_in& receiver, std::size_t packet_size);
  std::uint16_t port() const { return port_; }
  GigeCounts counts() const;

 private:
  struct Packet {
    Bytes header;
    ByteView data;
  };
  Packet MakePacket(const OutgoingFrame& frame, std::uint32_t number) const;
  void SendGroup(const sockaddr_in& receiver, const std::vector<Packet>& packets, bool again);

  Descriptor socket_;
  std::uint16_t port_ = 0;
  const GigeServerOptions options_;
  mutable std::mutex mutex_;  // of what follows
  std::deque<OutgoingFrame> recent_;
  Random luck_;
  GigeCounts counts_;
};

}  // namespace polarscan
