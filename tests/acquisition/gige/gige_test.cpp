// SPDX-License-Identifier: Apache-2.0
// Our GigE Vision camera over real UDP on the loopback interface, with Aravis as the client: the frames that
// arrive are those that were sent.
#include <cmath>

#include "gige/gige_camera.h"

namespace polarscan::test {
namespace {

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
