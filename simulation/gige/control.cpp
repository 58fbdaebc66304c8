// SPDX-License-Identifier: Apache-2.0
#include "simulation/gige/control.h"

#include "demosaic/sensor/pixel_format.h"
#include "simulation/gige/chunks.h"
#include "simulation/gige/control_socket.h"

namespace polarscan {
namespace {

constexpr std::uint32_t kInControl = 0x2, kExclusive = 0x1;

bool PacketSizeAllowed(std::uint32_t word) {
  const std::uint32_t size = word & GigeRegisters::kPacketSizeBits;
  return size >= gvsp::kLeastPacket && size <= gvsp::kMostPacket;
}

}  // namespace

GigeControl::GigeControl(GigeRegisters& registers, StreamSender& sender)
    : registers_(registers), sender_(sender) {
  UpdatePayloadSize();
}

Bytes GigeControl::Hear(ByteView datagram, const sockaddr_in& from) {
  const auto command = gvcp::Parse(datagram);
  if (!command) return {};
  if (command->command == gvcp::kResend) {
    if (const auto request = gvcp::ParseResend(command->payload)) sender_.Resend(*request);
    return {};
  }
  // Who got no answer asks again, with the same number, for what is done already.
  const bool again = command->id == answered_id_ && SameHost(from, answered_) && !answer_.empty();
  if (!again) answer_ = Answer(*command, from);
  answered_id_ = command->id, answered_ = from;
  return command->wants_answer ? answer_ : Bytes();
}

Bytes GigeControl::Answer(const gvcp::Command& command, const sockaddr_in& from) {
  const std::lock_guard lock(mutex_);
  if (in_control_ && SameHost(from, controller_)) heard_ = Clock::now();
  switch (command.command) {
    case gvcp::kDiscovery:
      return gvcp::Acknowledge(command, *registers_.Read(0, GigeRegisters::kDiscoveryBytes));
    case gvcp::kReadRegister:
      return ReadRegisters(command);
    case gvcp::kWriteRegister:
      return WriteRegisters(command, from);
    case gvcp::kReadMemory:
      return ReadMemory(command);
    case gvcp::kWriteMemory:
      return WriteMemory(command, from);
    default:
      return gvcp::Refuse(command, gvcp::kNotImplemented);
  }
}

Bytes GigeControl::ReadRegisters(const gvcp::Command& command) const {
  Bytes values;
  for (std::size_t at = 0; at + 4 <= command.payload.size(); at += 4) {
    const auto word = registers_.Read(GetBig<std::uint32_t>(command.payload, at), 4);
    if (!word) return gvcp::Refuse(command, gvcp::kInvalidAddress);
    values.insert(values.end(), word->begin(), word->end());
  }
  return gvcp::Acknowledge(command, values);
}

Bytes GigeControl::WriteRegisters(const gvcp::Command& command, const sockaddr_in& from) {
  std::uint16_t done = 0;
  for (std::size_t at = 0; at + 8 <= command.payload.size(); at += 8, ++done)
    if (const auto status =
            Write(GetBig<std::uint32_t>(command.payload, at), command.payload.subspan(at + 4, 4), from))
      return gvcp::Refuse(command, status);
  Bytes answer(2);
  PutBig<std::uint16_t>(answer, done);
  return gvcp::Acknowledge(command, answer);
}

Bytes GigeControl::ReadMemory(const gvcp::Command& command) const {
  if (command.payload.size() < 8) return gvcp::Refuse(command, gvcp::kInvalidHeader);
  const auto bytes =
      registers_.Read(GetBig<std::uint32_t>(command.payload, 0), GetBig<std::uint16_t>(command.payload, 6));
  if (!bytes) return gvcp::Refuse(command, gvcp::kInvalidAddress);
  Bytes answer(command.payload.begin(), command.payload.begin() + 4);
  answer.insert(answer.end(), bytes->begin(), bytes->end());
  return gvcp::Acknowledge(command, answer);
}

Bytes GigeControl::WriteMemory(const gvcp::Command& command, const sockaddr_in& from) {
  if (command.payload.size() < 4) return gvcp::Refuse(command, gvcp::kInvalidHeader);
  const ByteView bytes = command.payload.subspan(4);
  if (const auto status = Write(GetBig<std::uint32_t>(command.payload, 0), bytes, from))
    return gvcp::Refuse(command, status);
  Bytes answer(2);
  PutBig<std::uint16_t>(answer, bytes.size());
  return gvcp::Acknowledge(command, answer);
}

std::uint16_t GigeControl::Write(std::uint32_t address, ByteView bytes, const sockaddr_in& from) {
  if (in_control_ && !SameHost(from, controller_)) return gvcp::kAccessDenied;
  if (!in_control_ && address != GigeRegisters::kControl) return gvcp::kAccessDenied;
  const bool stream_settings = address == GigeRegisters::kPacketSize && bytes.size() == 4;
  if (stream_settings && !PacketSizeAllowed(GetBig<std::uint32_t>(bytes, 0))) return gvcp::kInvalidParameter;
  if (const auto status = registers_.Write(address, bytes)) return status;
  if (address == GigeRegisters::kControl) TakeControl(from);
  if (stream_settings) FireTestPacket();
  if (const GigeFeature* feature = registers_.At(address)) Obey(feature->name);
  return 0;
}

void GigeControl::TakeControl(const sockaddr_in& from) {
  in_control_ = (registers_.Word(GigeRegisters::kControl) & (kInControl | kExclusive)) != 0;
  if (!in_control_) return Forget();
  controller_ = from;
  heard_ = Clock::now();
}

void GigeControl::Forget() {
  in_control_ = acquiring_ = triggered_ = false;
  registers_.SetWord(GigeRegisters::kControl, 0);
}

void GigeControl::FireTestPacket() {
  const std::uint32_t word = registers_.Word(GigeRegisters::kPacketSize);
  if (!(word & GigeRegisters::kFireTest)) return;
  registers_.SetWord(GigeRegisters::kPacketSize, word & ~GigeRegisters::kFireTest);
  sender_.SendTest(StreamReceiver(), word & GigeRegisters::kPacketSizeBits);
}

void GigeControl::Obey(const std::string& feature) {
  if (feature == "AcquisitionStart") acquiring_ = true;
  if (feature == "AcquisitionStop") acquiring_ = false;
  if (feature == "ChunkSelector")
    registers_.SetInteger("ChunkEnable", chunks_.count(registers_.Integer("ChunkSelector")));
  if (feature == "ChunkEnable") EnableChunk();
  if (feature == "PixelFormat" || feature.starts_with("Chunk")) UpdatePayloadSize();
  if (feature == "TriggerMode") triggered_ = registers_.Integer("TriggerMode") == 1;
  if (feature == "TriggerSoftware") ++triggers_;
}

void GigeControl::UpdatePayloadSize() {
  const PixelFormat format = ParsePixelFormat(registers_.Entry("PixelFormat"));
  std::size_t bytes =
      PayloadBytes(format, int(registers_.Integer("Width")), int(registers_.Integer("Height")));
  if (registers_.Integer("ChunkModeActive") == 1) bytes += BytesOfChunks(chunks_.size());
  registers_.SetInteger("PayloadSize", std::uint32_t(bytes));
}

void GigeControl::EnableChunk() {
  const std::uint32_t id = registers_.Integer("ChunkSelector");
  if (registers_.Integer("ChunkEnable") == 1) {
    chunks_.insert(id);
  } else {
    chunks_.erase(id);
  }
}

sockaddr_in GigeControl::StreamReceiver() const {
  sockaddr_in receiver{};
  receiver.sin_family = AF_INET;
  receiver.sin_addr.s_addr = htonl(registers_.Word(GigeRegisters::kStreamAddress));
  receiver.sin_port = htons(std::uint16_t(registers_.Word(GigeRegisters::kStreamPort)));
  return receiver;
}

void GigeControl::ForgetSilentController() {
  const std::lock_guard lock(mutex_);
  if (silent()) heard_ = Clock::now();  // its own clock stands still too
  const auto silence = Clock::now() - heard_;
  if (in_control_ && silence > std::chrono::milliseconds(registers_.Word(GigeRegisters::kHeartbeatTimeout)))
    Forget();
}

void GigeControl::ForgetController() {
  const std::lock_guard lock(mutex_);
  Forget();
}

AcquisitionSettings GigeControl::acquisition() const {
  const std::lock_guard lock(mutex_);
  return {registers_.Entry("PixelFormat"), registers_.Float("AcquisitionFrameRate")};
}

StreamSettings GigeControl::stream() const {
  const std::lock_guard lock(mutex_);
  return {StreamReceiver(),
          registers_.Word(GigeRegisters::kPacketSize) & GigeRegisters::kPacketSizeBits,
          std::chrono::nanoseconds(registers_.Word(GigeRegisters::kPacketDelay)),
          registers_.Integer("PixelFormat"),
          registers_.Integer("ChunkModeActive") == 1,
          chunks_};
}

void GigeControl::SendTestPacket(std::size_t packet_size) {
  const std::lock_guard lock(mutex_);
  sender_.SendTest(StreamReceiver(), packet_size);
}

}  // namespace polarscan
