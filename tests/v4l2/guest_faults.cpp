// SPDX-License-Identifier: Apache-2.0
// The V4L2 backend on a real kernel with an imaginary camera (vivid) that refuses, fails, or goes and comes
// back. Runs in a virtual machine: see boot.
#include <sys/ioctl.h>

#include <filesystem>

#include "guest.h"

namespace polarscan::test {
namespace {

namespace fs = std::filesystem;

TEST_F(V4l2, ARefusedStartCanBeTriedAgain) {
  OpenWebcam();
  const std::pair<const char*, const char*> faults[] = {
      {"Inject VIDIOC_REQBUFS Error", "the camera gives no buffers (Invalid argument): /dev/video0"},
      {"Inject VIDIOC_QBUF Error", "the camera takes no buffers (Invalid argument): /dev/video0"},
      {"Inject VIDIOC_STREAMON Error", "the camera does not start (Invalid argument): /dev/video0"}};
  for (const auto& [fault, words] : faults) {
    SetControl(kCapture, fault);
    EXPECT_EQ(StartError(), words);
    camera_->Set("pixel-format", "Mono8");  // possible only if all buffers are given back
    camera_->Set("pixel-format", "Mono12");
  }
  EXPECT_EQ(StartError(), "");
  Expect(Delivery::kFrame);
}

TEST_F(V4l2, ABufferThatIsNotTakenRestartsTheStream) {
  StartWebcam();
  SetControl(kCapture, "Inject VIDIOC_QBUF Error");
  ExpectRestart(frame_.info.sequence + 1);
}

TEST_F(V4l2, ABrokenFrameIsDamagedAndTheOthersGoOn) {
  StartWebcam();
  SetControl(kCapture, "Inject V4L2_BUF_FLAG_ERROR");
  std::uint64_t last = frame_.info.sequence;
  int damaged = 0;
  for (int i = 0; i < 20; ++i) {
    const Delivery delivery = Next();
    EXPECT_GT(frame_.info.sequence, last);
    last = frame_.info.sequence;
    if (delivery == Delivery::kFrame) continue;
    ASSERT_EQ(int(delivery), int(Delivery::kDamaged));
    EXPECT_EQ(frame_.info.name, "marked as damaged by the driver");
    ++damaged;
  }
  EXPECT_EQ(damaged, 1);
}

TEST_F(V4l2, DroppedFramesAreGapsInTheNumbers) {
  OpenWebcam();
  camera_->Set("percentage_of_dropped_buffers", "50");
  camera_->Start(messages_);
  Expect(Delivery::kFrame);
  const std::uint64_t first = frame_.info.sequence;
  for (int i = 0; i < 20; ++i) ASSERT_NO_FATAL_FAILURE(Expect(Delivery::kFrame));
  EXPECT_GT(frame_.info.sequence - first, 22u);
}

TEST_F(V4l2, ASilentCameraIsNoError) {
  OpenWebcam();
  camera_->Set("percentage_of_dropped_buffers", "100");
  camera_->Start(messages_);
  EXPECT_EQ(int(Next(1)), int(Delivery::kNothing));
  camera_->Set("percentage_of_dropped_buffers", "0");
  Expect(Delivery::kFrame);
  EXPECT_EQ(messages_.text, "");
}

TEST_F(V4l2, AFatalErrorRestartsTheStream) {
  StartWebcam();
  SetControl(kCapture, "Inject Fatal Streaming Error");
  ExpectRestart(frame_.info.sequence + 1);
  EXPECT_TRUE(Said("the camera is gone (Input/output error); looking for it")) << messages_.text;
}

TEST_F(V4l2, ARefusedRestartIsTriedAgain) {
  StartWebcam();
  SetControl(kCapture, "Inject VIDIOC_STREAMON Error");
  SetControl(kCapture, "Inject Fatal Streaming Error");
  ExpectRestart(frame_.info.sequence + 1);
  EXPECT_TRUE(Said("the camera does not start (Invalid argument): /dev/video0")) << messages_.text;
}

TEST_F(V4l2, ADisconnectedCameraComesBack) {
  StartWebcam();
  const std::uint64_t frames = frame_.info.sequence + 1;
  SetControl(kCapture, "Disconnect");
  ExpectLoss();
  ExpectRestart(frames);
}

TEST_F(V4l2, AnUnpluggedCameraComesBackWithItsSettings) {
  OpenWebcam();
  camera_->Set("brightness", "77");
  camera_->Start(messages_);
  Expect(Delivery::kFrame);
  const std::uint64_t frames = frame_.info.sequence + 1;
  PlugOut();
  EXPECT_FALSE(fs::exists(kCapture));
  ExpectLoss();
  ExpectVainSearch("the camera cannot be opened (No such file or directory): /dev/video0");
  PlugIn();
  ExpectRestart(frames);
  EXPECT_EQ(camera_->features()["brightness"], 77);
  EXPECT_EQ(camera_->features()["fps"], 25);
}

TEST_F(V4l2, ACameraComesBackWithTheSizeThatNobodySet) {
  LoadVivid(kWebcam);
  const auto set_elsewhere = [](std::uint32_t width, std::uint32_t height) {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    format.fmt.pix.width = width, format.fmt.pix.height = height;
    ASSERT_EQ(::ioctl(Open(kCapture).fd, VIDIOC_S_FMT, &format), 0);
  };
  set_elsewhere(320, 180);
  camera_ = OpenV4l2Camera(kCapture);
  camera_->Start(messages_);
  Expect(Delivery::kFrame);
  const std::uint64_t frames = frame_.info.sequence + 1;
  PlugOut();
  ExpectLoss();
  PlugIn();
  ExpectRestart(frames);
}

TEST_F(V4l2, ACameraInUseIsRefusedWithAReason) {
  LoadVivid(kWebcam);
  const Descriptor other = Open(kCapture);
  StartStreaming(other);
  EXPECT_EQ(ErrorOf([] { OpenV4l2Camera(kCapture); }),
            "the camera refuses the format (Device or resource busy): /dev/video0. "
            "Another program uses the camera; end it first");
}

TEST_F(V4l2, ARestartCanWaitForAnotherProgram) {
  StartWebcam();
  const std::uint64_t frames = frame_.info.sequence + 1;
  SetControl(kCapture, "Disconnect");
  ExpectLoss();
  {
    const Descriptor other = Open(kCapture);
    StartStreaming(other);
    ExpectVainSearch("Another program uses the camera");
  }
  ExpectRestart(frames);
}

TEST_F(V4l2, StoppingAndStartingGivesFramesAgain) {
  StartWebcam();
  for (int i = 0; i < 5; ++i) {
    camera_->Stop();
    camera_->Start(messages_);
    Expect(Delivery::kFrame);
  }
  EXPECT_EQ(messages_.text, "");
}

}  // namespace
}  // namespace polarscan::test
