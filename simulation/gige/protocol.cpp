// SPDX-License-Identifier: Apache-2.0
#include "simulation/gige/protocol.h"

#include <map>

namespace polarscan {
namespace {

constexpr std::uint8_t kKey = 0x42, kAnswerFlag = 0x01;
constexpr std::uint8_t kLeader = 1, kTrailer = 2, kData = 3;
constexpr std::uint16_t kImagePayload = 1, kChunksBit = 0x4000;

Bytes Header(std::uint16_t block, std::uint8_t content, std::uint32_t number) {
  Bytes bytes;
  PutBig<std::uint16_t>(bytes, 0);  // status
  PutBig<std::uint16_t>(bytes, block);
  PutBig<std::uint32_t>(bytes, std::uint32_t(content) << 24 | (number & 0xffffff));
  return bytes;
}

std::uint16_t PayloadType(const gvsp::Image& image) {
  return image.chunks ? kImagePayload | kChunksBit : kImagePayload;
}

}  // namespace

namespace gvcp {

std::optional<Command> Parse(ByteView datagram) {
  if (datagram.size() < 8 || datagram[0] != kKey) return std::nullopt;
  const std::size_t length = GetBig<std::uint16_t>(datagram, 4);
  if (datagram.size() < 8 + length) return std::nullopt;
  return Command{GetBig<std::uint16_t>(datagram, 2), GetBig<std::uint16_t>(datagram, 6),
                 (datagram[1] & kAnswerFlag) != 0, datagram.subspan(8, length)};
}

Bytes Acknowledge(const Command& command, ByteView payload) {
  Bytes bytes;
  PutBig<std::uint16_t>(bytes, 0);
  PutBig<std::uint16_t>(bytes, command.command + 1u);
  PutBig<std::uint16_t>(bytes, payload.size());
  PutBig<std::uint16_t>(bytes, command.id);
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

Bytes Refuse(const Command& command, std::uint16_t status) {
  Bytes bytes = Acknowledge(command, {});
  bytes[0] = std::uint8_t(status >> 8);
  bytes[1] = std::uint8_t(status);
  return bytes;
}

std::optional<Resend> ParseResend(ByteView payload) {
  if (payload.size() < 12) return std::nullopt;
  return Resend{GetBig<std::uint16_t>(payload, 0), GetBig<std::uint16_t>(payload, 2),
                GetBig<std::uint32_t>(payload, 4) & 0xffffff, GetBig<std::uint32_t>(payload, 8) & 0xffffff};
}

}  // namespace gvcp

namespace gvsp {

std::size_t DataBytes(std::size_t packet_size) { return packet_size - kIpUdpBytes - kHeaderBytes; }

std::uint32_t DataPackets(std::size_t bytes, std::size_t packet_size) {
  const std::size_t each = DataBytes(packet_size);
  return std::uint32_t((bytes + each - 1) / each);
}

Bytes Leader(const Image& image) {
  Bytes bytes = Header(image.block, kLeader, 0);
  PutBig<std::uint16_t>(bytes, 0);
  PutBig<std::uint16_t>(bytes, PayloadType(image));
  PutBig<std::uint64_t>(bytes, image.timestamp);
  for (const std::uint32_t value :
       {image.pixel_format, image.width, image.height, image.offset_x, image.offset_y, 0u})
    PutBig<std::uint32_t>(bytes, value);
  return bytes;
}

Bytes DataHeader(std::uint16_t block, std::uint32_t number) { return Header(block, kData, number); }

Bytes Trailer(const Image& image, std::uint32_t number) {
  Bytes bytes = Header(image.block, kTrailer, number);
  PutBig<std::uint16_t>(bytes, 0);
  PutBig<std::uint16_t>(bytes, PayloadType(image));
  PutBig<std::uint32_t>(bytes, image.height);
  return bytes;
}

void PutChunkTag(Bytes& payload, std::uint32_t id, std::size_t length) {
  PutBig<std::uint32_t>(payload, id);
  PutBig<std::uint32_t>(payload, length);
}

}  // namespace gvsp

std::optional<std::uint32_t> PixelFormatCode(const std::string& name) {
  static const std::map<std::string, std::uint32_t> kCodes = {
      {"Mono8", 0x01080001},           {"Mono10", 0x01100003},          {"Mono12", 0x01100005},
      {"Mono12Packed", 0x010C0006},    {"Mono14", 0x01100025},          {"Mono16", 0x01100007},
      {"Mono10p", 0x010A0046},         {"Mono12p", 0x010C0047},         {"BayerGR8", 0x01080008},
      {"BayerRG8", 0x01080009},        {"BayerGB8", 0x0108000A},        {"BayerBG8", 0x0108000B},
      {"BayerGR10", 0x0110000C},       {"BayerRG10", 0x0110000D},       {"BayerGB10", 0x0110000E},
      {"BayerBG10", 0x0110000F},       {"BayerGR12", 0x01100010},       {"BayerRG12", 0x01100011},
      {"BayerGB12", 0x01100012},       {"BayerBG12", 0x01100013},       {"BayerGR12Packed", 0x010C002A},
      {"BayerRG12Packed", 0x010C002B}, {"BayerGB12Packed", 0x010C002C}, {"BayerBG12Packed", 0x010C002D},
      {"BayerGR16", 0x0110002E},       {"BayerRG16", 0x0110002F},       {"BayerGB16", 0x01100030},
      {"BayerBG16", 0x01100031},       {"BayerBG10p", 0x010A0052},      {"BayerBG12p", 0x010C0053},
      {"BayerGB10p", 0x010A0054},      {"BayerGB12p", 0x010C0055},      {"BayerGR10p", 0x010A0056},
      {"BayerGR12p", 0x010C0057},      {"BayerRG10p", 0x010A0058},      {"BayerRG12p", 0x010C0059}};
  const auto found = kCodes.find(name);
  return found == kCodes.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace polarscan
