// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <netinet/in.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <string>

#include "simulation/gige/protocol.h"
#include "simulation/gige/registers.h"
#include "simulation/gige/stream_sender.h"

namespace polarscan {

// What the source is told before it starts.
struct AcquisitionSettings {
  std::string pixel_format;
  double frames_per_s = 0;
};

// How the controller wants a frame sent, and where to.
struct StreamSettings {
  sockaddr_in receiver{};
  std::size_t packet_size = 0;       // bytes, as GevSCPSPacketSize
  std::chrono::nanoseconds delay{};  // between packets
  std::uint32_t pixel_format = 0;    // PFNC code
  bool chunks = false;               // whether any come with the picture
  std::set<std::uint32_t> chunk_ids;
};

// The camera as its controller sees it (GVCP): who that is, what the registers hold, and what a write to them
// does. One thread belongs to control, another one to the stream.
class GigeControl {
 public:
  using Clock = std::chrono::steady_clock;

  // Both are kept as references; the sender sends what control asks for: packets again, test packets.
  GigeControl(GigeRegisters& registers, StreamSender& sender);

  // Control: the answer to a datagram; empty: none is wanted. Nothing is heard while the camera is silent.
  Bytes Hear(ByteView datagram, const sockaddr_in& from);
  bool silent() const { return Clock::now() < silent_until_.load(); }
  // Control: lets go of a controller that has not been heard for longer than its heartbeat.
  void ForgetSilentController();

  // The stream.
  bool acquiring() const { return acquiring_; }
  void EndAcquisition() { acquiring_ = false; }
  AcquisitionSettings acquisition() const;
  StreamSettings stream() const;
  void SendTestPacket(std::size_t packet_size);
  // Software triggers: those that have no frame yet are counted.
  bool WaitsForTrigger() const { return triggered_ && triggers_ == 0; }
  void CountTriggeredFrame() {
    if (triggered_) --triggers_;
  }
  void ForgetTriggers() { triggers_ = 0; }
  // The faults: dead for a while; and everything is forgotten that the controller said.
  void BeSilentUntil(Clock::time_point end) { silent_until_ = end; }
  void ForgetController();

 private:
  Bytes Answer(const gvcp::Command& command, const sockaddr_in& from);
  Bytes ReadRegisters(const gvcp::Command& command) const;
  Bytes WriteRegisters(const gvcp::Command& command, const sockaddr_in& from);
  Bytes ReadMemory(const gvcp::Command& command) const;
  Bytes WriteMemory(const gvcp::Command& command, const sockaddr_in& from);
  // Writes and does what the write asks for. A GVCP status, 0 if all is well.
  std::uint16_t Write(std::uint32_t address, ByteView bytes, const sockaddr_in& from);
  void TakeControl(const sockaddr_in& from);
  void Forget();
  void FireTestPacket();
  void Obey(const std::string& feature);
  void UpdatePayloadSize();
  void EnableChunk();
  sockaddr_in StreamReceiver() const;

  mutable std::mutex mutex_;  // of registers, chunks, controller, heard
  GigeRegisters& registers_;
  StreamSender& sender_;
  std::set<std::uint32_t> chunks_;  // ids of those that are on
  sockaddr_in controller_{};
  Clock::time_point heard_;
  Bytes answer_;  // the last one, as the next lines: control's thread only
  sockaddr_in answered_{};
  std::uint16_t answered_id_ = 0;
  std::atomic<bool> in_control_ = false, acquiring_ = false, triggered_ = false;
  std::atomic<int> triggers_ = 0;  // not yet answered
  std::atomic<Clock::time_point> silent_until_{};
};

}  // namespace polarscan
