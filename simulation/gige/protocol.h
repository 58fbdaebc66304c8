// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace polarscan {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

// Big-endian numbers, as GigE Vision has them everywhere.
template <class T>
T GetBig(ByteView bytes, std::size_t at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) value = value << 8 | bytes[at + i];
  return T(value);
}
template <class T>
void PutBig(Bytes& bytes, std::uint64_t value) {
  for (int shift = 8 * int(sizeof(T)) - 8; shift >= 0; shift -= 8)
    bytes.push_back(std::uint8_t(value >> shift));
}

// GVCP, the control protocol (GigE Vision 2.0, part 2). Acknowledges have the command's number plus one.
namespace gvcp {
constexpr std::uint16_t kPort = 3956;
constexpr std::uint16_t kDiscovery = 0x0002, kResend = 0x0040, kReadRegister = 0x0080,
                        kWriteRegister = 0x0082, kReadMemory = 0x0084, kWriteMemory = 0x0086;
constexpr std::uint16_t kNotImplemented = 0x8001, kInvalidParameter = 0x8002, kInvalidAddress = 0x8003,
                        kWriteProtected = 0x8004, kAccessDenied = 0x8006, kInvalidHeader = 0x800E;

struct Command {
  std::uint16_t command = 0, id = 0;
  bool wants_answer = false;
  ByteView payload;  // into the datagram
};
// Nothing if the datagram is no GVCP command or is cut off.
std::optional<Command> Parse(ByteView datagram);

Bytes Acknowledge(const Command& command, ByteView payload);
Bytes Refuse(const Command& command, std::uint16_t status);

// What a resend command asks for: packets first..last of a block.
struct Resend {
  std::uint16_t channel = 0, block = 0;
  std::uint32_t first = 0, last = 0;
};
std::optional<Resend> ParseResend(ByteView payload);
}  // namespace gvcp

// GVSP, the stream protocol (part 3), with 16-bit block numbers: a block (frame) is a leader, payload packets
// numbered from 1, and a trailer.
namespace gvsp {
constexpr std::size_t kHeaderBytes = 8;
constexpr std::size_t kIpUdpBytes = 28;                         // GevSCPSPacketSize counts them
constexpr std::size_t kLeastPacket = 576, kMostPacket = 65000;  // that we allow it to be

struct Image {
  std::uint16_t block = 0;
  std::uint64_t timestamp = 0;     // ticks
  std::uint32_t pixel_format = 0;  // PFNC code
  std::uint32_t width = 0, height = 0, offset_x = 0, offset_y = 0;
  std::size_t bytes = 0;  // of payload
  bool chunks = false;    // the payload is made of chunks, the picture first
};

// Payload bytes in a packet of GevSCPSPacketSize bytes; payload packets of an image.
std::size_t DataBytes(std::size_t packet_size);
std::uint32_t DataPackets(std::size_t bytes, std::size_t packet_size);

Bytes Leader(const Image& image);
// The 8 bytes before the data of packet `number` (1, 2, ...).
Bytes DataHeader(std::uint16_t block, std::uint32_t number);
Bytes Trailer(const Image& image, std::uint32_t number);

// Ends the chunk of `length` bytes that was put last.
void PutChunkTag(Bytes& payload, std::uint32_t id, std::size_t length);
}  // namespace gvsp

// The 32-bit code of a standard pixel format (PFNC 2.4) by its name. Nothing for other names: vendors' codes
// collide.
std::optional<std::uint32_t> PixelFormatCode(const std::string& name);

}  // namespace polarscan
