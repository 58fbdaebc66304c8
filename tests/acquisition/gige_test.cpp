// SPDX-License-Identifier: Apache-2.0
// Our GigE Vision camera over real UDP on the loopback interface, with Aravis as the client: the frames that
// arrive are those that were sent, whatever happens on the way, or are counted.
#include "simulation/gige/gige_server.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <thread>

#include "acquisition/camera/aravis_camera.h"
#include "acquisition/capture.h"
#include "core/descriptor.h"
#include "session_helpers.h"
#include "simulation/gige/packets.h"
#include "simulation/simulated_camera.h"

namespace polarscan::test {
namespace {

SimulatedCameraOptions SmallScene(const std::string& format, double fps) {
  SimulatedCameraOptions options;
  options.simulator.width = 256, options.simulator.height = 192;
  options.simulator.rings = "33:3";
  options.simulator.samples = 1;
  options.simulator.scene.scene = "sphere";
  options.simulator.scene.table = options.simulator.scene.blocks = false;
  options.pixel_format = format;
  options.fps = fps;
  return options;
}

// Another camera, changed in something.
class CameraAround : public Camera {
 public:
  explicit CameraAround(const SimulatedCameraOptions& options) : camera_(OpenSimulatedCamera(options)) {}
  CameraInfo info() const override { return camera_->info(); }
  nlohmann::json sensor() const override { return camera_->sensor(); }
  nlohmann::json features() const override { return camera_->features(); }
  void Set(const std::string& feature, const std::string& value) override { camera_->Set(feature, value); }
  void Start(Progress& progress) override { camera_->Start(progress); }
  void Stop() override { camera_->Stop(); }
  Delivery Next(Frame& frame, std::chrono::milliseconds timeout) override {
    return camera_->Next(frame, timeout);
  }

 private:
  std::unique_ptr<Camera> camera_;
};

// Remembers the payloads that it gave, in their order.
class RememberingCamera : public CameraAround {
 public:
  using CameraAround::CameraAround;
  Delivery Next(Frame& frame, std::chrono::milliseconds timeout) override {
    const Delivery delivery = CameraAround::Next(frame, timeout);
    const std::lock_guard lock(mutex_);
    if (delivery == Delivery::kFrame) given_.push_back(frame.payload);
    return delivery;
  }
  std::vector<Bytes> given() const {
    const std::lock_guard lock(mutex_);
    return given_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<Bytes> given_;
};

// A camera at an address of its own, so that tests may run side by side.
class ServedCamera {
 public:
  ServedCamera(const SimulatedCameraOptions& options, const GigeServerOptions& gige,
               std::unique_ptr<Camera> camera = nullptr, int other = 0)
      : camera_(Started(camera ? std::move(camera) : OpenSimulatedCamera(options))),
        server_({*camera_,
                 options.simulator.width,
                 options.simulator.height,
                 {options.pixel_format},
                 options.fps,
                 [this](const std::string& format, double fps) {
                   camera_->Set("pixel-format", format);
                   camera_->Set("fps", fmt::format("{}", fps));
                 }},
                Address(other), gige),
        thread_([this] { server_.Run(stop_); }) {}
  ~ServedCamera() {
    stop_.Cancel();
    thread_.join();
  }
  // other: of another camera of the same test.
  static std::string Address(int other = 0) {
    return fmt::format("127.{}.{}.{}", 1 + getpid() / 65536 % 100 + 100 * other, getpid() / 256 % 256,
                       getpid() % 256);
  }
  GigeCounts counts() const { return server_.counts(); }

 private:
  // Its pictures are ready, so that a client gets frames at once.
  static std::unique_ptr<Camera> Started(std::unique_ptr<Camera> camera) {
    Progress silent;
    camera->Start(silent);
    return camera;
  }

  std::unique_ptr<Camera> camera_;
  Progress stop_;
  GigeServer server_;
  std::thread thread_;
};

class GigeTest : public SessionFolder {
 protected:
  // Records `frames` frames and holds every stored one against what the camera sent under its number.
  FrameCounts RecordAndCompare(const SimulatedCameraOptions& options, const GigeServerOptions& gige,
                               int frames, double seconds = 60) {
    auto remembering = std::make_unique<RememberingCamera>(options);
    const RememberingCamera& camera = *remembering;
    const ServedCamera served(options, gige, std::move(remembering));
    const std::unique_ptr<Camera> client = OpenAravisCamera(ServedCamera::Address());
    FrameCounts counts = Capture(*client, session(), nlohmann::json::object(),
                                 {.frames = frames, .seconds = seconds}, {}, listener_)
                             .counts;
    const Session recorded = OpenSession(session(), Verify::kPayloads);
    EXPECT_TRUE(recorded.damage.empty());
    EXPECT_EQ(recorded.frames.size(), counts.stored);
    const std::vector<Bytes> sent = camera.given();
    std::size_t next = 0;  // the first that may come
    for (std::size_t i = 0; i < recorded.frames.size(); ++i) {
      const Frame frame = ReadFrame(recorded, i);
      // A camera that a busy machine lost for a moment begins anew; ours goes on counting.
      std::size_t at = frame.info.sequence;
      if (counts.restarts > 0)
        at = std::size_t(
            std::find(sent.begin() + std::ptrdiff_t(std::min(next, sent.size())), sent.end(), frame.payload) -
            sent.begin());
      EXPECT_TRUE(at < sent.size() && frame.payload == sent[at])
          << Difference(frame, sent) << listener_.words();
      next = at + 1;
    }
    resent_ = served.counts().resent;
    return counts;
  }

  // In words, for who must find out where a payload comes from.
  static std::string Difference(const Frame& frame, const std::vector<Bytes>& sent) {
    std::string text =
        fmt::format("frame {}: {} bytes, {} x {}, {} ns by the camera's clock; ", frame.info.sequence,
                    frame.payload.size(), frame.info.width, frame.info.height, frame.info.camera_time_ns);
    if (frame.info.sequence < sent.size()) {
      const Bytes& wanted = sent[frame.info.sequence];
      const auto [a, b] = std::ranges::mismatch(frame.payload, wanted);
      text += fmt::format("the camera sent {} bytes, other ones from byte {} on; ", wanted.size(),
                          a - frame.payload.begin());
    } else {
      text += fmt::format("the camera sent only {}; ", sent.size());
    }
    const auto same = std::ranges::find(sent, frame.payload);
    return text + (same == sent.end() ? "like none that it sent\n"
                                      : fmt::format("like its frame {}\n", same - sent.begin()));
  }

  static std::vector<Bytes> Sent(SimulatedCameraOptions options, int frames) {
    options.fps = 10000;
    const std::unique_ptr<Camera> camera = OpenSimulatedCamera(options);
    Progress silent;
    camera->Start(silent);
    std::vector<Bytes> payloads;
    Frame frame;
    while (int(payloads.size()) < frames)
      if (camera->Next(frame, std::chrono::seconds(1)) == Delivery::kFrame) payloads.push_back(frame.payload);
    return payloads;
  }

  // Keeps what is said.
  class Listener : public Progress {
   public:
    void Warn(const std::string& message) override {
      const std::lock_guard lock(mutex_);
      words_ += message + "\n";
    }
    std::string words() const {
      const std::lock_guard lock(mutex_);
      return words_;
    }

   private:
    mutable std::mutex mutex_;
    std::string words_;
  };

  Listener listener_;
  std::uint64_t resent_ = 0;
};

TEST(GigePackets, AReadCommandIsParsedAndAnsweredByteForByte) {
  const Bytes datagram = {0x42, 0x01, 0x00, 0x80, 0x00, 0x04, 0x12, 0x34, 0x00, 0x00, 0x0A, 0x00};
  const auto command = gvcp::Parse(datagram);
  ASSERT_TRUE(command);
  EXPECT_EQ(command->command, gvcp::kReadRegister);
  EXPECT_TRUE(command->wants_answer);
  EXPECT_EQ(GetBig<std::uint32_t>(command->payload, 0), 0x0A00u);
  EXPECT_EQ(gvcp::Acknowledge(*command, Bytes{0, 0, 0, 2}),
            (Bytes{0, 0, 0x00, 0x81, 0x00, 0x04, 0x12, 0x34, 0, 0, 0, 2}));
  EXPECT_EQ(gvcp::Refuse(*command, gvcp::kAccessDenied),
            (Bytes{0x80, 0x06, 0x00, 0x81, 0x00, 0x00, 0x12, 0x34}));
}

TEST(GigePackets, WhatIsCutOffOrNotGvcpIsNoCommand) {
  const Bytes whole = {0x42, 0x01, 0x00, 0x80, 0x00, 0x04, 0x12, 0x34, 0x00, 0x00, 0x0A, 0x00};
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(gvcp::Parse(ByteView(whole).first(size)));
  Bytes other = whole;
  other[0] = 0x43;
  EXPECT_FALSE(gvcp::Parse(other));
}

TEST(GigePackets, ALeaderHoldsFormatAndSize) {
  const Bytes leader = gvsp::Leader({7, 0x0102030405060708, 0x01080001, 2448, 2048, 0, 0, 2448 * 2048});
  EXPECT_EQ(leader, (Bytes{0, 0, 0, 7, 1,    0,    0, 0, 0,    0, 0, 1, 1, 2, 3, 4, 5, 6, 7, 8, 0x01, 0x08,
                           0, 1, 0, 0, 0x09, 0x90, 0, 0, 0x08, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,    0}));
  EXPECT_EQ(gvsp::DataPackets(1000, 536), 2u);
  EXPECT_EQ(gvsp::DataPackets(1001, 536), 3u);
}

TEST(FrameNumbersTest, SixteenBitNumbersGoOnOverTheWrapWhichLeavesZeroOut) {
  FrameNumbers numbers(true);
  EXPECT_EQ(numbers.Unwrap(65533), 0u);
  EXPECT_EQ(numbers.Unwrap(65534), 1u);
  EXPECT_EQ(numbers.Unwrap(65535), 2u);
  EXPECT_EQ(numbers.Unwrap(1), 3u);
  EXPECT_EQ(numbers.Unwrap(3), 5u);  // 2 is lost
  EXPECT_EQ(numbers.Unwrap(2), 4u);  // no, late
  EXPECT_EQ(numbers.Unwrap(4), 6u);
}

TEST(FrameNumbersTest, TheFirstFramesMayBeMissing) {
  FrameNumbers gige(true), usb(false);
  EXPECT_EQ(gige.Unwrap(3), 2u);
  EXPECT_EQ(gige.Unwrap(4), 3u);
  EXPECT_EQ(usb.Unwrap(1), 1u);
}

TEST(FrameNumbersTest, LongNumbersAreTakenAsTheyAre) {
  FrameNumbers gige(true), usb(false);
  EXPECT_EQ(gige.Unwrap(65535), 0u);
  EXPECT_EQ(gige.Unwrap(65536), 1u);
  EXPECT_EQ(gige.Unwrap(65540), 5u);
  EXPECT_EQ(usb.Unwrap(0), 0u);
  EXPECT_EQ(usb.Unwrap(70000), 70000u);
}

TEST_F(GigeTest, FramesArriveByteForByte) {
  for (const char* format : {"Mono8", "Mono12p", "Mono12Packed", "Mono16"}) {
    const FrameCounts counts = RecordAndCompare(SmallScene(format, 50), {}, 20);
    EXPECT_EQ(counts.stored, 20u) << format;
    EXPECT_EQ(counts.lost, 0u) << format << ": " << Describe(counts);
    EXPECT_EQ(OpenSession(session()).frames.front().info.temperature_c, 40) << "as the camera says";
    std::filesystem::remove_all(session());
  }
}

TEST_F(GigeTest, LostPacketsAreSentAgain) {
  GigeServerOptions gige;
  gige.faults.loss = 0.04;
  const FrameCounts counts = RecordAndCompare(SmallScene("Mono12p", 20), gige, 60);
  EXPECT_EQ(counts.stored, 60u);
  EXPECT_EQ(counts.lost, 0u) << Describe(counts);
  EXPECT_GT(resent_, 5u);
}

TEST_F(GigeTest, PacketsThatComeTwiceDoNoHarm) {
  GigeServerOptions gige;
  gige.faults.duplicates = 0.2;
  EXPECT_EQ(RecordAndCompare(SmallScene("Mono8", 50), gige, 20).stored, 20u);
}

TEST_F(GigeTest, ALateTestPacketIsNoFrame) {
  GigeServerOptions gige;
  gige.faults.stray_packet = true;
  const FrameCounts counts = RecordAndCompare(SmallScene("Mono8", 50), gige, 20);
  EXPECT_EQ(counts.stored, 20u);
  EXPECT_EQ(counts.lost, 0u) << Describe(counts);
}

// A simulated camera whose exposure grows from frame to frame.
class ChangingExposure : public CameraAround {
 public:
  using CameraAround::CameraAround;
  Delivery Next(Frame& frame, std::chrono::milliseconds timeout) override {
    const Delivery delivery = CameraAround::Next(frame, timeout);
    frame.info.exposure_us = 1000.5 + double(frame.info.sequence);
    return delivery;
  }
};

TEST_F(GigeTest, ValuesThatComeWithAPictureAreItsOwnAndNotInItsPayload) {
  const SimulatedCameraOptions options = SmallScene("Mono12p", 50);
  const ServedCamera served(options, {}, std::make_unique<ChangingExposure>(options));
  const std::unique_ptr<Camera> client = OpenAravisCamera(ServedCamera::Address());
  client->Set("chunks", "ExposureTime,FrameID");
  EXPECT_EQ(
      Capture(*client, session(), nlohmann::json::object(), {.frames = 12, .seconds = 60}, {}, listener_)
          .counts.stored,
      12u);
  const std::vector<Bytes> sent = Sent(options, 12);
  const Session recorded = OpenSession(session(), Verify::kPayloads);
  for (std::size_t i = 0; i < recorded.frames.size(); ++i) {
    const Frame frame = ReadFrame(recorded, i);
    EXPECT_TRUE(frame.payload == sent.at(frame.info.sequence)) << i;
    EXPECT_EQ(frame.info.exposure_us, 1000.5 + double(frame.info.sequence));
    EXPECT_TRUE(std::isnan(frame.info.gain_db)) << "not asked for, and the camera has no such feature";
  }
  EXPECT_THROW(client->Set("chunks", "Weather"), Error);
}

TEST_F(GigeTest, AFormatChangeInTheStreamIsCountedNotStored) {
  GigeServerOptions gige;
  gige.faults.format_change_at = 11;
  const SimulatedCameraOptions options = SmallScene("Mono8", 50);
  const ServedCamera served(options, gige);
  const std::unique_ptr<Camera> client = OpenAravisCamera(ServedCamera::Address());
  const FrameCounts counts =
      Capture(*client, session(), nlohmann::json::object(), {.seconds = 6}, {}, listener_).counts;
  EXPECT_EQ(counts.stored, 10u) << Describe(counts);
  EXPECT_GT(counts.lost, 10u);
  EXPECT_GT(counts.reasons.at("lost: the picture's format or size changed"), 10u);
}

TEST_F(GigeTest, ACameraThatComesBackIsRecordedInANewSegment) {
  GigeServerOptions gige;
  gige.faults.disconnect_at = 60;  // late enough for a busy machine to have stored some
  gige.faults.fault_s = 8;         // Aravis gives up after six
  const SimulatedCameraOptions options = SmallScene("Mono8", 50);
  const ServedCamera served(options, gige);
  const std::unique_ptr<Camera> client = OpenAravisCamera(ServedCamera::Address());
  const FrameCounts counts =
      Capture(*client, session(), nlohmann::json::object(), {.frames = 90, .seconds = 60}, {}, listener_)
          .counts;
  EXPECT_EQ(counts.stored, 90u) << Describe(counts);
  EXPECT_GE(counts.restarts, 1u);  // a busy machine may lose it once more
  const Session recorded = OpenSession(session(), Verify::kPayloads);
  EXPECT_GE(recorded.segments, 2u);
  EXPECT_EQ(recorded.frames.front().segment, 0u);
  EXPECT_EQ(recorded.frames.back().segment + 1, recorded.segments);
}

// Cameras of different makers may have the same serial number.
class SameSerial : public CameraAround {
 public:
  using CameraAround::CameraAround;
  CameraInfo info() const override { return {"made up", "polarscan", "made up", "17"}; }
};

TEST_F(GigeTest, AnotherCameraInThePlaceOfOneThatIsGoneIsNotRecorded) {
  GigeServerOptions gige;
  gige.faults.disconnect_at = 60;
  gige.faults.fault_s = 12;  // Aravis gives up after six
  const SimulatedCameraOptions options = SmallScene("Mono8", 50);
  const ServedCamera served(options, gige, std::make_unique<SameSerial>(options));
  const ServedCamera other(options, {}, std::make_unique<SameSerial>(options), 1);
  const std::unique_ptr<Camera> client = OpenAravisCamera(ServedCamera::Address());
  const FrameCounts counts =
      Capture(*client, session(), nlohmann::json::object(), {.frames = 90, .seconds = 60}, {}, listener_)
          .counts;
  EXPECT_EQ(counts.stored, 90u) << Describe(counts);
  EXPECT_GE(counts.restarts, 1u);
  EXPECT_EQ(other.counts().frames, 0u);
}

// Sends frames to every UDP socket of this process on 127.0.0.1, and to one that nobody reads, as if they
// were two more streams on this machine.
class OtherStreams {
 public:
  OtherStreams() : thread_([this] { Run(); }) {}
  ~OtherStreams() {
    stop_ = true;
    thread_.join();
  }

 private:
  static Descriptor Bound(const char* address) {
    Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    sockaddr_in name{};
    name.sin_family = AF_INET;
    ::inet_pton(AF_INET, address, &name.sin_addr);
    EXPECT_EQ(::bind(socket.fd, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
    return socket;
  }

  void Run() {
    const Descriptor unread = Bound("127.0.0.1"), from = Bound("127.0.0.66");
    for (std::uint16_t block = 1; !stop_; ++block) {
      const gvsp::Image image{block, 1, 0x01080001, 256, 192, 0, 0, 256 * 192};
      const std::size_t packet_size = 16404, each = gvsp::DataBytes(packet_size);
      std::vector<Bytes> packets = {gvsp::Leader(image)};
      for (std::size_t at = 0; at < image.bytes; at += each) {
        packets.push_back(gvsp::DataHeader(block, std::uint32_t(packets.size())));
        packets.back().resize(gvsp::kHeaderBytes + std::min(each, image.bytes - at), 0xAA);
      }
      packets.push_back(gvsp::Trailer(image, std::uint32_t(packets.size())));
      for (int fd = 0; fd < 200; ++fd) {
        sockaddr_in name{};
        socklen_t size = sizeof name;
        if (::getsockname(fd, reinterpret_cast<sockaddr*>(&name), &size) != 0 || name.sin_family != AF_INET ||
            name.sin_addr.s_addr != htonl(INADDR_LOOPBACK))
          continue;
        for (const Bytes& packet : packets)
          ::sendto(from.fd, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&name), size);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

TEST_F(GigeTest, PacketsOfOtherStreamsAreNoFrames) {
  const OtherStreams others;
  for (int i = 0; i < 5; ++i) {
    const FrameCounts counts = RecordAndCompare(SmallScene("Mono8", 50), {}, 10, 20);
    EXPECT_EQ(counts.stored, 10u) << Describe(counts);
    std::filesystem::remove_all(session());
  }
}

TEST_F(GigeTest, FramesThatAreCutOtherwiseThanAgreedAreCountedNotStored) {
  for (const int size : {1000, 16400, 16408, 40000}) {
    GigeServerOptions gige;
    gige.faults.packet_size = size;
    const FrameCounts counts = RecordAndCompare(SmallScene("Mono8", 50), gige, 0, 2);
    EXPECT_EQ(counts.stored, 0u) << size;
    EXPECT_GT(counts.lost, 10u) << size << ": " << Describe(counts);
    std::filesystem::remove_all(session());
  }
}

TEST_F(GigeTest, PicturesWithValuesThatAreCutOtherwiseThanAgreedAreNotStoredEither) {
  for (const int size : {16400, 16408}) {
    GigeServerOptions gige;
    gige.faults.packet_size = size;
    const SimulatedCameraOptions options = SmallScene("Mono8", 50);
    const ServedCamera served(options, gige, std::make_unique<ChangingExposure>(options));
    const std::unique_ptr<Camera> client = OpenAravisCamera(ServedCamera::Address());
    client->Set("chunks", "ExposureTime,FrameID,Timestamp");
    const FrameCounts counts =
        Capture(*client, session(), nlohmann::json::object(), {.seconds = 2}, {}, listener_).counts;
    EXPECT_EQ(counts.stored, 0u) << size;
    EXPECT_GT(counts.lost, 10u) << size << ": " << Describe(counts);
    std::filesystem::remove_all(session());
  }
}

TEST_F(GigeTest, AFrameWhoseLeaderNeverComesShiftsNoOthersNumber) {
  for (const auto& [first, headless] : {std::pair{1, 1}, {1, 3}, {40000, 3}}) {
    GigeServerOptions gige;
    gige.faults.first_number = first;
    gige.faults.headless_at = headless;
    const FrameCounts counts = RecordAndCompare(SmallScene("Mono8", 10), gige, 6);
    EXPECT_EQ(counts.stored, 6u) << Describe(counts);
    EXPECT_EQ(counts.lost, headless == 1 ? 0u : 1u) << Describe(counts);
    std::filesystem::remove_all(session());
  }
}

TEST_F(GigeTest, ACameraThatFallsSilentForAWhileLosesNothingAndItIsSaid) {
  GigeServerOptions gige;
  gige.faults.freeze_at = 8;
  gige.faults.fault_s = 4;  // Aravis gives up after six
  const FrameCounts counts = RecordAndCompare(SmallScene("Mono8", 50), gige, 20);
  EXPECT_EQ(counts.stored, 20u) << Describe(counts);
  EXPECT_EQ(counts.lost + counts.restarts, 0u) << Describe(counts);
  EXPECT_NE(listener_.words().find("no frame for 3 s"), std::string::npos) << listener_.words();
}

TEST_F(GigeTest, AFrameThatEndsTooSoonIsCountedAndTheOthersAreStored) {
  GigeServerOptions gige;
  gige.faults.short_at = 5;
  const FrameCounts counts = RecordAndCompare(SmallScene("Mono8", 20), gige, 20);
  EXPECT_EQ(counts.stored, 20u) << Describe(counts);
  EXPECT_EQ(counts.lost, 1u) << Describe(counts);
  const Session recorded = OpenSession(session());
  ASSERT_EQ(recorded.missing.size(), 1u);
  EXPECT_EQ(recorded.missing[0].first, 4u);
}

TEST_F(GigeTest, AJumpOfTheCamerasClockIsSaidAndTheFramesAreStored) {
  GigeServerOptions gige;
  gige.faults.clock_jump_at = 6;
  EXPECT_EQ(RecordAndCompare(SmallScene("Mono8", 50), gige, 12).stored, 12u);
  EXPECT_NE(listener_.words().find("clock jumped by 3600"), std::string::npos) << listener_.words();
}

TEST_F(GigeTest, FrameNumbersGoOnOverTheWrapOfSixteenBits) {
  GigeServerOptions gige;
  gige.faults.first_number = 65527;
  const FrameCounts counts = RecordAndCompare(SmallScene("Mono8", 50), gige, 25);
  EXPECT_EQ(counts.stored, 25u) << Describe(counts);
  EXPECT_EQ(counts.lost, 0u) << Describe(counts);
}

TEST_F(GigeTest, WithASoftwareTriggerOnlyWantedFramesAreTaken) {
  const SimulatedCameraOptions options = SmallScene("Mono8", 50);
  const ServedCamera served(options, {});
  const std::unique_ptr<Camera> client = OpenAravisCamera(ServedCamera::Address());
  const FrameCounts counts =
      Capture(*client, session(), nlohmann::json::object(),
              {.frames = 6, .seconds = 60, .every_s = 0.5, .trigger = true, .shot_frames = 2}, {}, listener_)
          .counts;
  EXPECT_EQ(counts.stored, 6u) << Describe(counts);
  EXPECT_EQ(counts.lost + counts.cancelled, 0u) << Describe(counts);
  EXPECT_EQ(served.counts().frames, 6u);
  const std::vector<Bytes> sent = Sent(options, 6);
  const Session recorded = OpenSession(session());
  for (std::size_t i = 0; i < recorded.frames.size(); ++i)
    EXPECT_TRUE(ReadFrame(recorded, i).payload == sent[i]) << i;
}

TEST_F(GigeTest, ASecondClientIsTurnedAway) {
  const ServedCamera served(SmallScene("Mono8", 10), {});
  const std::unique_ptr<Camera> first = OpenAravisCamera(ServedCamera::Address());
  EXPECT_THROW(OpenAravisCamera(ServedCamera::Address()), Error);
}

}  // namespace
}  // namespace polarscan::test
