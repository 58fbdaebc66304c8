// SPDX-License-Identifier: Apache-2.0
#include "simulation/gige/stream_sender.h"

#include <sys/socket.h>

#include <algorithm>
#include <thread>

#include "core/files/files.h"

namespace polarscan {
namespace {

constexpr std::size_t kGroup = 16, kRecentFrames = 8;
constexpr int kSendBuffer = 4 << 20;

}  // namespace

StreamSender::StreamSender(const in_addr& from, const GigeServerOptions& options)
    : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)), options_(options), luck_(options.seed, 11) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr = from;
  socklen_t size = sizeof address;
  const bool good = socket_.fd >= 0 &&
                    ::bind(socket_.fd, reinterpret_cast<const sockaddr*>(&address), size) == 0 &&
                    ::getsockname(socket_.fd, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  if (!good) ThrowSystemError("cannot open a socket for the stream", "UDP");
  ::setsockopt(socket_.fd, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
  port_ = ntohs(address.sin_port);
}

// Packet 0 is the leader, the last one the trailer.
StreamSender::Packet StreamSender::MakePacket(const OutgoingFrame& frame, std::uint32_t number) const {
  const std::uint32_t data_packets = gvsp::DataPackets(frame.image.bytes, frame.packet_size);
  if (number == 0) return {gvsp::Leader(frame.image), {}};
  if (number > data_packets) return {gvsp::Trailer(frame.image, number), {}};
  const std::size_t each = gvsp::DataBytes(frame.packet_size), begin = each * (number - 1);
  return {gvsp::DataHeader(frame.image.block, number),
          ByteView(*frame.payload).subspan(begin, std::min(each, frame.image.bytes - begin))};
}

void StreamSender::SendGroup(const sockaddr_in& receiver, const std::vector<Packet>& packets, bool again) {
  std::vector<const Packet*> chosen;
  {
    const std::lock_guard lock(mutex_);
    for (const Packet& packet : packets) {
      ++counts_.packets;
      counts_.resent += again;
      if (options_.faults.loss > 0 && luck_.Uniform() < options_.faults.loss) {
        ++counts_.lost;
        continue;
      }
      chosen.push_back(&packet);
      if (options_.faults.duplicates > 0 && luck_.Uniform() < options_.faults.duplicates)
        chosen.push_back(&packet);
    }
  }
  std::vector<iovec> parts(2 * chosen.size());
  std::vector<mmsghdr> messages(chosen.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    parts[2 * i] = {const_cast<std::uint8_t*>(chosen[i]->header.data()), chosen[i]->header.size()};
    parts[2 * i + 1] = {const_cast<std::uint8_t*>(chosen[i]->data.data()), chosen[i]->data.size()};
    messages[i].msg_hdr.msg_iov = &parts[2 * i];
    messages[i].msg_hdr.msg_iovlen = 2;
    messages[i].msg_hdr.msg_name = const_cast<sockaddr_in*>(&receiver);
    messages[i].msg_hdr.msg_namelen = sizeof receiver;
  }
  // Nobody may listen (any more): that is the receiver's business.
  for (std::size_t sent = 0; sent < messages.size();) {
    const int n = ::sendmmsg(socket_.fd, messages.data() + sent, unsigned(messages.size() - sent), 0);
    if (n > 0) sent += std::size_t(n);
    if (n < 0 && errno != EINTR) ++sent;
  }
}

void StreamSender::Send(const OutgoingFrame& frame, std::chrono::nanoseconds duration) {
  {
    const std::lock_guard lock(mutex_);
    recent_.push_back(frame);
    if (recent_.size() > kRecentFrames) recent_.pop_front();
    ++counts_.frames;
  }
  const std::uint32_t count = gvsp::DataPackets(frame.image.bytes, frame.packet_size) + 2;
  const auto begin = std::chrono::steady_clock::now();
  std::vector<Packet> group;
  for (std::uint32_t number = 0; number < count; ++number) {
    if (number > 0 || !frame.headless) group.push_back(MakePacket(frame, number));
    if (group.size() < kGroup && number + 1 < count) continue;
    SendGroup(frame.receiver, group, false);
    group.clear();
    std::this_thread::sleep_until(begin + duration * (number + 1) / count);
  }
}

void StreamSender::Resend(const gvcp::Resend& request) {
  OutgoingFrame frame;
  {
    const std::lock_guard lock(mutex_);
    const auto found =  // the latest: numbers begin anew with every stream
        std::find_if(recent_.rbegin(), recent_.rend(),
                     [&](const OutgoingFrame& f) { return f.image.block == request.block; });
    if (found == recent_.rend()) {
      ++counts_.unavailable;
      return;
    }
    frame = *found;
  }
  const std::uint32_t last =
      std::min(request.last, gvsp::DataPackets(frame.image.bytes, frame.packet_size) + 1);
  std::vector<Packet> packets;
  for (std::uint32_t number = request.first; number <= last; ++number)
    if (number > 0 || !frame.headless) packets.push_back(MakePacket(frame, number));
  SendGroup(frame.receiver, packets, true);
}

void StreamSender::SendTest(const sockaddr_in& receiver, std::size_t packet_size) {
  const Bytes bytes(packet_size > gvsp::kIpUdpBytes ? packet_size - gvsp::kIpUdpBytes : 0);
  ::sendto(socket_.fd, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&receiver),
           sizeof receiver);
}

GigeCounts StreamSender::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace polarscan
