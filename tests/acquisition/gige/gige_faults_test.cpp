// SPDX-License-Identifier: Apache-2.0
// A GigE Vision camera that goes away, falls silent or sends what was not agreed: its frames are stored as
// they were sent, or are counted.
#include <arpa/inet.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "core/files/descriptor.h"
#include "gige/gige_camera.h"
#include "simulation/gige/protocol.h"

namespace polarscan::test {
namespace {

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

}  // namespace
}  // namespace polarscan::test
