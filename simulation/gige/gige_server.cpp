// SPDX-License-Identifier: Apache-2.0
#include "simulation/gige/gige_server.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <poll.h>
#include <sys/socket.h>

#include <atomic>
#include <bit>
#include <cmath>
#include <set>
#include <thread>

#include "core/error.h"
#include "core/files.h"
#include "demosaic/pixel_format.h"
#include "simulation/gige/registers.h"
#include "simulation/gige/stream_sender.h"

namespace polarscan {
namespace {

using Clock = std::chrono::steady_clock;
using Kind = GigeFeature::Kind;

constexpr auto kPoll = std::chrono::milliseconds(20), kTriggerPoll = std::chrono::milliseconds(1);
constexpr std::uint32_t kInControl = 0x2, kExclusive = 0x1;
constexpr std::size_t kLargestDatagram = 65536;
constexpr std::size_t kChunkBytes = 8, kChunkTagBytes = 8;
constexpr std::int64_t kClockJumpNs = 3600LL * 1000000000;

std::vector<GigeFeature> FeaturesOf(const GigeSource& source) {
  GigeFeature formats{"PixelFormat", Kind::kEnumeration, true};
  for (const std::string& name : source.pixel_formats) {
    const auto code = PixelFormatCode(name);
    if (!code) throw Error("a GigE Vision camera cannot send this pixel format", name);
    formats.entries.emplace_back(name, *code);
  }
  formats.value = formats.entries.at(0).second;
  const double width = source.width, height = source.height;
  GigeFeature mode{"AcquisitionMode", Kind::kEnumeration, true};
  mode.entries = {{"Continuous", 0}};
  GigeFeature trigger{"TriggerMode", Kind::kEnumeration, true};
  trigger.entries = {{"Off", 0}, {"On", 1}};
  GigeFeature trigger_source{"TriggerSource", Kind::kEnumeration, true};
  trigger_source.entries = {{"Software", 0}};
  GigeFeature chunk{"ChunkSelector", Kind::kEnumeration, true};
  for (const GigeChunk& c : kGigeChunks) chunk.entries.emplace_back(c.name, c.id);
  chunk.value = kGigeChunks[0].id;
  return {
      {"SensorWidth", Kind::kInteger, false, width},
      {"SensorHeight", Kind::kInteger, false, height},
      {"Width", Kind::kInteger, false, width, width, width},
      {"Height", Kind::kInteger, false, height, height, height},
      {"OffsetX", Kind::kInteger, false, 0, 0, 0},
      {"OffsetY", Kind::kInteger, false, 0, 0, 0},
      formats,
      {"PayloadSize", Kind::kInteger, false, 0},
      mode,
      {"AcquisitionStart", Kind::kCommand},
      {"AcquisitionStop", Kind::kCommand},
      trigger,
      trigger_source,
      {"TriggerSoftware", Kind::kCommand},
      {"AcquisitionFrameRate", Kind::kFloat, true, source.frames_per_s, 0.01, 10000, "Hz"},
      {"TLParamsLocked", Kind::kInteger, true, 0, 0, 1},
      {"DeviceTemperature", Kind::kFloat, false, 40, -50, 150, "C"},
      {"TimestampTickFrequency", Kind::kInteger, false, 1e9},
      {"ChunkModeActive", Kind::kBoolean, true},
      chunk,
      {"ChunkEnable", Kind::kBoolean, true},
  };
}

in_addr AddressOf(const std::string& text) {
  in_addr address{};
  if (::inet_pton(AF_INET, text.c_str(), &address) != 1)
    throw Error("this is no IPv4 address", text, "Write it as 127.0.0.1");
  return address;
}

GigeIdentity IdentityOf(const Camera& source, const in_addr& address) {
  const CameraInfo info = source.info();
  // Several simulated cameras may be there at once; serial numbers tell cameras apart.
  const std::string serial = info.id == "simulated" ? ::inet_ntoa(address) : info.serial;
  GigeIdentity identity{info.vendor, info.model, POLARSCAN_VERSION, serial, {}};
  const std::uint32_t host = ntohl(address.s_addr);
  for (int i = 0; i < 4; ++i) identity.address[std::size_t(i)] = std::uint8_t(host >> (24 - 8 * i));
  return identity;
}

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

bool SameHost(const sockaddr_in& a, const sockaddr_in& b) {
  return a.sin_addr.s_addr == b.sin_addr.s_addr && a.sin_port == b.sin_port;
}

}  // namespace

class GigeServer::Implementation {
 public:
  Implementation(GigeSource source, const std::string& address, const GigeServerOptions& options)
      : source_(std::move(source)),
        options_(options),
        registers_(IdentityOf(source_.camera, AddressOf(address)), FeaturesOf(source_)),
        control_(ControlSocket(AddressOf(address), true)),
        broadcast_(ControlSocket({INADDR_BROADCAST}, false)),
        sender_(AddressOf(address), options) {
    UpdatePayloadSize();
  }

  void Run(Progress& progress) {
    ForgetOldQuestions();
    std::thread stream([&] {
      try {
        Stream(progress);
      } catch (const Cancelled&) {
      } catch (...) {
        failure_ = std::current_exception();
        failed_ = true;
      }
    });
    while (!progress.cancelled() && !failed_) Serve();
    stop_ = true;
    stream.join();
    source_.camera.Stop();
    if (failure_) std::rethrow_exception(failure_);
  }

  GigeCounts counts() const { return sender_.counts(); }

  // The answer; empty: none is wanted.
  Bytes Hear(ByteView datagram, const sockaddr_in& from) {
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

 private:
  // Control.

  // Who asked while the camera got ready has given up.
  void ForgetOldQuestions() const {
    char byte = 0;
    for (const int socket : {control_.fd, broadcast_.fd})
      while (::recv(socket, &byte, 1, MSG_DONTWAIT | MSG_TRUNC) >= 0) {
      }
  }

  void Serve() {
    pollfd sockets[] = {{control_.fd, POLLIN, 0}, {broadcast_.fd, POLLIN, 0}};
    if (::poll(sockets, 2, int(kPoll.count())) > 0)
      for (const pollfd& socket : sockets)
        if (socket.revents & POLLIN) Receive(socket.fd);
    const std::lock_guard lock(mutex_);
    if (Clock::now() < silent_until_.load()) heard_ = Clock::now();  // its own clock stands still too
    const auto silence = Clock::now() - heard_;
    if (in_control_ && silence > std::chrono::milliseconds(registers_.Word(GigeRegisters::kHeartbeatTimeout)))
      Forget();
  }

  void Receive(int socket) {
    Bytes datagram(kLargestDatagram);
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t n =
        ::recvfrom(socket, datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    if (n <= 0 || Clock::now() < silent_until_.load()) return;
    const Bytes answer = Hear(ByteView(datagram).first(std::size_t(n)), from);
    if (!answer.empty())
      ::sendto(control_.fd, answer.data(), answer.size(), 0, reinterpret_cast<const sockaddr*>(&from), size);
  }

  Bytes Answer(const gvcp::Command& command, const sockaddr_in& from) {
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

  Bytes ReadRegisters(const gvcp::Command& command) const {
    Bytes values;
    for (std::size_t at = 0; at + 4 <= command.payload.size(); at += 4) {
      const auto word = registers_.Read(GetBig<std::uint32_t>(command.payload, at), 4);
      if (!word) return gvcp::Refuse(command, gvcp::kInvalidAddress);
      values.insert(values.end(), word->begin(), word->end());
    }
    return gvcp::Acknowledge(command, values);
  }

  Bytes WriteRegisters(const gvcp::Command& command, const sockaddr_in& from) {
    std::uint16_t done = 0;
    for (std::size_t at = 0; at + 8 <= command.payload.size(); at += 8, ++done)
      if (const auto status =
              Write(GetBig<std::uint32_t>(command.payload, at), command.payload.subspan(at + 4, 4), from))
        return gvcp::Refuse(command, status);
    Bytes answer(2);
    PutBig<std::uint16_t>(answer, done);
    return gvcp::Acknowledge(command, answer);
  }

  Bytes ReadMemory(const gvcp::Command& command) const {
    if (command.payload.size() < 8) return gvcp::Refuse(command, gvcp::kInvalidHeader);
    const auto bytes =
        registers_.Read(GetBig<std::uint32_t>(command.payload, 0), GetBig<std::uint16_t>(command.payload, 6));
    if (!bytes) return gvcp::Refuse(command, gvcp::kInvalidAddress);
    Bytes answer(command.payload.begin(), command.payload.begin() + 4);
    answer.insert(answer.end(), bytes->begin(), bytes->end());
    return gvcp::Acknowledge(command, answer);
  }

  Bytes WriteMemory(const gvcp::Command& command, const sockaddr_in& from) {
    if (command.payload.size() < 4) return gvcp::Refuse(command, gvcp::kInvalidHeader);
    const ByteView bytes = command.payload.subspan(4);
    if (const auto status = Write(GetBig<std::uint32_t>(command.payload, 0), bytes, from))
      return gvcp::Refuse(command, status);
    Bytes answer(2);
    PutBig<std::uint16_t>(answer, bytes.size());
    return gvcp::Acknowledge(command, answer);
  }

  // Writes and does what the write asks for. A GVCP status, 0 if all is well.
  std::uint16_t Write(std::uint32_t address, ByteView bytes, const sockaddr_in& from) {
    if (in_control_ && !SameHost(from, controller_)) return gvcp::kAccessDenied;
    if (!in_control_ && address != GigeRegisters::kControl) return gvcp::kAccessDenied;
    const bool stream_settings = address == GigeRegisters::kPacketSize && bytes.size() == 4;
    if (stream_settings && !PacketSizeAllowed(GetBig<std::uint32_t>(bytes, 0)))
      return gvcp::kInvalidParameter;
    if (const auto status = registers_.Write(address, bytes)) return status;
    if (address == GigeRegisters::kControl) TakeControl(from);
    if (stream_settings) TestPacket();
    if (const GigeFeature* feature = registers_.At(address)) Obey(feature->name);
    return 0;
  }

  static bool PacketSizeAllowed(std::uint32_t word) {
    const std::uint32_t size = word & GigeRegisters::kPacketSizeBits;
    return size >= gvsp::kLeastPacket && size <= gvsp::kMostPacket;
  }

  void TakeControl(const sockaddr_in& from) {
    in_control_ = (registers_.Word(GigeRegisters::kControl) & (kInControl | kExclusive)) != 0;
    if (!in_control_) return Forget();
    controller_ = from;
    heard_ = Clock::now();
  }

  void Forget() {
    in_control_ = acquiring_ = triggered_ = false;
    registers_.SetWord(GigeRegisters::kControl, 0);
  }

  void TestPacket() {
    const std::uint32_t word = registers_.Word(GigeRegisters::kPacketSize);
    if (!(word & GigeRegisters::kFireTest)) return;
    registers_.SetWord(GigeRegisters::kPacketSize, word & ~GigeRegisters::kFireTest);
    sender_.SendTest(StreamReceiver(), word & GigeRegisters::kPacketSizeBits);
  }

  void Obey(const std::string& feature) {
    if (feature == "AcquisitionStart") acquiring_ = true;
    if (feature == "AcquisitionStop") acquiring_ = false;
    if (feature == "ChunkSelector")
      registers_.SetInteger("ChunkEnable", chunks_.count(registers_.Integer("ChunkSelector")));
    if (feature == "ChunkEnable") EnableChunk();
    if (feature == "PixelFormat" || feature.starts_with("Chunk")) UpdatePayloadSize();
    if (feature == "TriggerMode") triggered_ = registers_.Integer("TriggerMode") == 1;
    if (feature == "TriggerSoftware") ++triggers_;
  }

  void UpdatePayloadSize() {
    const PixelFormat format = ParsePixelFormat(registers_.Entry("PixelFormat"));
    std::size_t bytes =
        PayloadBytes(format, int(registers_.Integer("Width")), int(registers_.Integer("Height")));
    if (registers_.Integer("ChunkModeActive") == 1)
      bytes += kChunkTagBytes + chunks_.size() * (kChunkBytes + kChunkTagBytes);
    registers_.SetInteger("PayloadSize", std::uint32_t(bytes));
  }

  void EnableChunk() {
    const std::uint32_t id = registers_.Integer("ChunkSelector");
    if (registers_.Integer("ChunkEnable") == 1) {
      chunks_.insert(id);
    } else {
      chunks_.erase(id);
    }
  }

  // The picture, and behind it what the client wants to know of it and the source knows.
  static Bytes WithChunks(const Frame& frame, const gvsp::Image& image, const std::set<std::uint32_t>& ids) {
    Bytes payload = frame.payload;
    gvsp::PutChunkTag(payload, 0, payload.size());
    const auto put = [&](std::uint32_t id, std::uint64_t value) {
      if (ids.count(id) == 0) return;
      PutBig<std::uint64_t>(payload, value);
      gvsp::PutChunkTag(payload, id, kChunkBytes);
    };
    const auto put_float = [&](std::uint32_t id, double value) {
      if (!std::isnan(value)) put(id, std::bit_cast<std::uint64_t>(value));
    };
    put(kGigeChunks[0].id, image.timestamp);
    put(kGigeChunks[1].id, image.block);
    put_float(kGigeChunks[2].id, frame.info.exposure_us);
    put_float(kGigeChunks[3].id, frame.info.gain_db);
    return payload;
  }

  sockaddr_in StreamReceiver() const {
    sockaddr_in receiver{};
    receiver.sin_family = AF_INET;
    receiver.sin_addr.s_addr = htonl(registers_.Word(GigeRegisters::kStreamAddress));
    receiver.sin_port = htons(std::uint16_t(registers_.Word(GigeRegisters::kStreamPort)));
    return receiver;
  }

  // Stream.
  void Stream(Progress& progress) {
    Frame frame;
    while (!stop_) {
      if (!acquiring_) {
        std::this_thread::sleep_for(kPoll);
        continue;
      }
      Configure(progress);
      while (!stop_ && acquiring_) {
        if (triggered_ && triggers_ == 0) {
          std::this_thread::sleep_for(kTriggerPoll);
          continue;
        }
        const Delivery delivery = source_.camera.Next(frame, kPoll);
        if (delivery == Delivery::kEnded) acquiring_ = false;
        if (delivery != Delivery::kFrame) continue;
        if (triggered_) --triggers_;
        SendFrame(frame);
      }
    }
  }

  void Configure(Progress& progress) {
    std::string format;
    {
      const std::lock_guard lock(mutex_);
      format = registers_.Entry("PixelFormat");
      period_ = std::chrono::duration<double>(1 / registers_.Float("AcquisitionFrameRate"));
    }
    source_.configure(format, 1 / period_.count());
    source_.camera.Start(progress);
    triggers_ = 0;
    if (options_.faults.stray_packet) {
      const std::lock_guard lock(mutex_);
      sender_.SendTest(StreamReceiver(), gvsp::kLeastPacket);
    }
    block_ = std::uint16_t(options_.faults.first_number - 1);
  }

  void SendFrame(const Frame& frame) {
    OutgoingFrame out;
    std::chrono::nanoseconds delay;
    std::set<std::uint32_t> chunks;
    {
      const std::lock_guard lock(mutex_);
      out.receiver = StreamReceiver();
      out.packet_size = registers_.Word(GigeRegisters::kPacketSize) & GigeRegisters::kPacketSizeBits;
      delay = std::chrono::nanoseconds(registers_.Word(GigeRegisters::kPacketDelay));
      out.image.pixel_format = registers_.Integer("PixelFormat");
      out.image.chunks = registers_.Integer("ChunkModeActive") == 1;
      chunks = chunks_;
    }
    block_ = block_ == 0xffff ? std::uint16_t(1) : std::uint16_t(block_ + 1);
    ++sent_;
    const GigeFaults& faults = options_.faults;
    if (faults.packet_size > 0) out.packet_size = std::size_t(faults.packet_size);
    out.headless = sent_ == std::uint64_t(faults.headless_at);
    const auto from = [&](int number) { return number > 0 && sent_ >= std::uint64_t(number); };
    const bool half = from(faults.format_change_at), cut = sent_ == std::uint64_t(faults.short_at);
    out.image.block = block_;
    out.image.timestamp =
        std::uint64_t(frame.info.camera_time_ns + (from(faults.clock_jump_at) ? kClockJumpNs : 0));
    out.image.width = std::uint32_t(frame.info.width);
    out.image.height = std::uint32_t(half ? frame.info.height / 2 : frame.info.height);
    out.payload = std::make_shared<const Bytes>(out.image.chunks ? WithChunks(frame, out.image, chunks)
                                                                 : frame.payload);
    out.image.bytes = half || cut ? out.payload->size() / 2 : out.payload->size();
    const auto by_packets = delay * gvsp::DataPackets(out.image.bytes, out.packet_size);
    const auto by_pace = std::chrono::duration_cast<std::chrono::nanoseconds>(period_ * options_.pace);
    sender_.Send(out, std::max(by_pace, by_packets));
    DoFaults();
  }

  void DoFaults() {
    const bool freeze = sent_ == std::uint64_t(options_.faults.freeze_at);
    const bool disconnect = sent_ == std::uint64_t(options_.faults.disconnect_at);
    if (!freeze && !disconnect) return;
    const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                        std::chrono::duration<double>(options_.faults.fault_s));
    silent_until_ = end;
    while (!stop_ && Clock::now() < end) std::this_thread::sleep_for(kPoll);
    const std::lock_guard lock(mutex_);
    if (disconnect) Forget();
  }

  GigeSource source_;
  const GigeServerOptions options_;
  std::mutex mutex_;  // of registers, chunks, controller, heard
  GigeRegisters registers_;
  std::set<std::uint32_t> chunks_;  // ids of those that are on
  sockaddr_in controller_{};
  Clock::time_point heard_;
  Bytes answer_;  // the last one, as the next line: control's thread only
  sockaddr_in answered_{};
  std::uint16_t answered_id_ = 0;
  std::atomic<bool> in_control_ = false, acquiring_ = false, stop_ = false, failed_ = false;
  std::atomic<bool> triggered_ = false;
  std::atomic<int> triggers_ = 0;  // not yet answered
  std::atomic<Clock::time_point> silent_until_{};
  Descriptor control_, broadcast_;
  StreamSender sender_;
  std::exception_ptr failure_;
  std::chrono::duration<double> period_{1};  // stream's thread only, as the next line
  std::uint16_t block_ = 0;
  std::uint64_t sent_ = 0;
};

OptionTable Table(GigeServerOptions& o) {
  return {
      {"pace", &o.pace, "a frame is sent in this share of the time between two frames", "", 0, 1},
      {"packet-loss", &o.faults.loss, "share of the packets that get lost", "", 0, 1},
      {"packet-duplicates", &o.faults.duplicates, "share of the packets that come twice", "", 0, 1},
      {"freeze-at", &o.faults.freeze_at, "after this frame the camera is dead for --fault-time", "frame", 0,
       2e9},
      {"disconnect-at", &o.faults.disconnect_at, "the same, and then it has forgotten everything", "frame", 0,
       2e9},
      {"format-change-at", &o.faults.format_change_at, "frames are half as high from this one on", "frame", 0,
       2e9},
      {"short-at", &o.faults.short_at, "this frame ends after half of its packets", "frame", 0, 2e9},
      {"headless-at", &o.faults.headless_at, "this frame's leader never comes", "frame", 0, 2e9},
      {"packet-size", &o.faults.packet_size, "of the stream, whatever was agreed; 0: as agreed", "byte", 0,
       65000},
      {"clock-jump-at", &o.faults.clock_jump_at, "the camera's clock is an hour ahead from this one on",
       "frame", 0, 2e9},
      {"stray-packet", &o.faults.stray_packet, "a late test packet comes at the beginning of each stream"},
      {"first-number", &o.faults.first_number, "number of a stream's first frame, of 16 bits", "", 1, 65535},
      {"fault-time", &o.faults.fault_s, "of freeze and disconnect", "s", 0, 1e6},
  };
}

GigeServer::GigeServer(GigeSource source, const std::string& address, const GigeServerOptions& options)
    : implementation_(std::make_unique<Implementation>(std::move(source), address, options)) {}
GigeServer::~GigeServer() = default;
void GigeServer::Run(Progress& progress) { implementation_->Run(progress); }
Bytes GigeServer::Answer(ByteView datagram) { return implementation_->Hear(datagram, {}); }
GigeCounts GigeServer::counts() const { return implementation_->counts(); }

}  // namespace polarscan
