// SPDX-License-Identifier: Apache-2.0
#include "simulation/gige/stream.h"

#include <algorithm>
#include <memory>
#include <thread>

#include "simulation/gige/chunks.h"

namespace polarscan {
namespace {

constexpr auto kStreamPoll = std::chrono::milliseconds(20), kTriggerPoll = std::chrono::milliseconds(1);
constexpr std::int64_t kClockJumpNs = 3600LL * 1000000000;

}  // namespace

void GigeStream::Run(Progress& progress) {
  Frame frame;
  while (!stop_) {
    if (!control_.acquiring()) {
      std::this_thread::sleep_for(kStreamPoll);
      continue;
    }
    StartSource(progress);
    while (!stop_ && control_.acquiring()) SendNext(frame);
  }
}

void GigeStream::StartSource(Progress& progress) {
  const AcquisitionSettings settings = control_.acquisition();
  period_ = std::chrono::duration<double>(1 / settings.frames_per_s);
  source_.configure(settings.pixel_format, 1 / period_.count());
  source_.camera.Start(progress);
  control_.ForgetTriggers();
  if (options_.faults.stray_packet) control_.SendTestPacket(gvsp::kLeastPacket);
  block_ = std::uint16_t(options_.faults.first_number - 1);
}

void GigeStream::SendNext(Frame& frame) {
  if (control_.WaitsForTrigger()) {
    std::this_thread::sleep_for(kTriggerPoll);
    return;
  }
  const Delivery delivery = source_.camera.Next(frame, kStreamPoll);
  if (delivery == Delivery::kEnded) control_.EndAcquisition();
  if (delivery != Delivery::kFrame) return;
  control_.CountTriggeredFrame();
  SendFrame(frame);
}

void GigeStream::SendFrame(const Frame& frame) {
  const StreamSettings settings = control_.stream();
  block_ = block_ == 0xffff ? std::uint16_t(1) : std::uint16_t(block_ + 1);
  ++sent_;
  const OutgoingFrame out = Outgoing(frame, settings);
  const auto by_packets = settings.delay * gvsp::DataPackets(out.image.bytes, out.packet_size);
  const auto by_pace = std::chrono::duration_cast<std::chrono::nanoseconds>(period_ * options_.pace);
  sender_.Send(out, std::max(by_pace, by_packets));
  DoFaults();
}

OutgoingFrame GigeStream::Outgoing(const Frame& frame, const StreamSettings& settings) const {
  const GigeFaults& faults = options_.faults;
  const auto from = [&](int number) { return number > 0 && sent_ >= std::uint64_t(number); };
  const bool half = from(faults.format_change_at), cut = sent_ == std::uint64_t(faults.short_at);
  OutgoingFrame out;
  out.receiver = settings.receiver;
  out.packet_size = faults.packet_size > 0 ? std::size_t(faults.packet_size) : settings.packet_size;
  out.headless = sent_ == std::uint64_t(faults.headless_at);
  out.image.pixel_format = settings.pixel_format;
  out.image.chunks = settings.chunks;
  out.image.block = block_;
  out.image.timestamp =
      std::uint64_t(frame.info.camera_time_ns + (from(faults.clock_jump_at) ? kClockJumpNs : 0));
  out.image.width = std::uint32_t(frame.info.width);
  out.image.height = std::uint32_t(half ? frame.info.height / 2 : frame.info.height);
  out.payload = std::make_shared<const Bytes>(
      settings.chunks ? WithChunks(frame, out.image, settings.chunk_ids) : frame.payload);
  out.image.bytes = half || cut ? out.payload->size() / 2 : out.payload->size();
  return out;
}

void GigeStream::DoFaults() {
  const bool freeze = sent_ == std::uint64_t(options_.faults.freeze_at);
  const bool disconnect = sent_ == std::uint64_t(options_.faults.disconnect_at);
  if (!freeze && !disconnect) return;
  const auto end = GigeControl::Clock::now() + std::chrono::duration_cast<GigeControl::Clock::duration>(
                                                   std::chrono::duration<double>(options_.faults.fault_s));
  control_.BeSilentUntil(end);
  while (!stop_ && GigeControl::Clock::now() < end) std::this_thread::sleep_for(kStreamPoll);
  if (disconnect) control_.ForgetController();
}

}  // namespace polarscan
