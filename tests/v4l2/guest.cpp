// SPDX-License-Identifier: Apache-2.0
// The V4L2 backend on a real kernel with an imaginary camera (vivid): pictures and settings. Runs in a
// virtual machine: see boot.
#include "guest.h"

#include <cstring>
#include <filesystem>
#include <set>

namespace polarscan::test {

// Sends random pictures through the cable; each that arrives must be one of them.
void V4l2::ExpectExactPictures(std::uint32_t code, const std::string& name, int width, int height, int rate,
                               int count) {
  LoadVivid(kHdmiCable);
  for (const char* device : {kCapture, kOutput}) SetTimings(device, width, height, rate);
  const Sender sender(code, width, height);
  camera_ = OpenV4l2Camera(kCapture);
  camera_->Set("pixel-format", name);
  camera_->Set("width", std::to_string(width));
  camera_->Set("height", std::to_string(height));
  camera_->Set("osd_text_mode", "2");
  camera_->Set("loop_video", "1");
  camera_->Set("buffers", "4");
  camera_->Start(messages_);
  std::set<std::uint64_t> seen;
  while (seen.size() < std::size_t(count)) {  // two clocks: some come twice, some never
    ASSERT_NO_FATAL_FAILURE(Expect(Delivery::kFrame));
    EXPECT_EQ(frame_.info.pixel_format, name);
    ASSERT_EQ(frame_.payload.size(), std::size_t(width * height * (name == "Mono8" ? 1 : 2)));
    std::uint64_t n = 0;
    std::memcpy(&n, frame_.payload.data(), sizeof n);
    ASSERT_LE(n, sender.sent()) << "this is no picture that was sent";
    EXPECT_TRUE(frame_.payload == SentPicture(n, frame_.payload.size())) << "picture " << n << " has changed";
    seen.insert(n);
  }
}

namespace {

namespace fs = std::filesystem;

TEST_F(V4l2, Mono8ArrivesByteForByte) { ExpectExactPictures(V4L2_PIX_FMT_GREY, "Mono8", 640, 480, 40, 10); }
TEST_F(V4l2, Mono10ArrivesByteForByte) { ExpectExactPictures(V4L2_PIX_FMT_Y10, "Mono10", 640, 480, 40, 10); }
TEST_F(V4l2, Mono12ArrivesByteForByte) { ExpectExactPictures(V4L2_PIX_FMT_Y12, "Mono12", 640, 480, 40, 10); }
TEST_F(V4l2, Mono16ArrivesByteForByte) { ExpectExactPictures(V4L2_PIX_FMT_Y16, "Mono16", 640, 480, 40, 10); }
TEST_F(V4l2, PicturesOfFiveMegapixelsArriveByteForByte) {
  ExpectExactPictures(V4L2_PIX_FMT_Y12, "Mono12", 2448, 2048, 5, 4);
}

TEST_F(V4l2, OnlyCamerasAreListedByTheirLastingNames) {
  LoadVivid(kHdmiCable);
  std::vector<CameraInfo> cameras = ListV4l2Cameras();
  ASSERT_EQ(cameras.size(), 1u);
  EXPECT_EQ(cameras[0].id, kCapture);
  EXPECT_EQ(cameras[0].vendor, "vivid");
  const fs::path link = "/dev/v4l/by-id/usb-Imaginary_Camera-video-index0";
  fs::create_directories(link.parent_path());
  fs::create_symlink("../../video0", link);
  cameras = ListV4l2Cameras();
  ASSERT_EQ(cameras.size(), 1u);
  EXPECT_EQ(cameras[0].id, link);
  camera_ = OpenV4l2Camera(cameras[0].id);
  fs::remove(link);
  EXPECT_NE(ErrorOf([] { OpenV4l2Camera(kOutput); }).find("this is no video capture device"),
            std::string::npos);
}

// A test picture without a clock in it, as the driver draws it.
TEST_F(V4l2, AMultiplanarCameraSendsTheSamePictures) {
  std::vector<std::vector<std::uint8_t>> pictures;
  for (const char* options : {kWebcam, kManyPlanes}) {
    LoadVivid(options);
    camera_ = OpenV4l2Camera(kCapture);
    EXPECT_EQ(ListV4l2Cameras().size(), 1u);
    for (const auto& [name, value] : {std::pair("width", "320"), {"height", "180"}, {"fps", "25"}})
      camera_->Set(name, value);
    camera_->Set("osd_text_mode", "2");
    camera_->Set("pixel-format", "Mono12");
    camera_->Start(messages_);
    ASSERT_NO_FATAL_FAILURE(Expect(Delivery::kFrame));
    EXPECT_EQ(frame_.info.width, 320);
    EXPECT_EQ(camera_->features()["fps"], 25);
    pictures.push_back(frame_.payload);
    camera_.reset();
    ASSERT_TRUE(UnloadVivid());
  }
  EXPECT_EQ(pictures[0].size(), 2u * 320 * 180);
  EXPECT_TRUE(pictures[0] == pictures[1]);
  LoadVivid(kManyPlanes);  // and it comes back as others do
  camera_ = OpenV4l2Camera(kCapture);
  camera_->Set("width", "320");
  camera_->Set("height", "180");
  camera_->Start(messages_);
  Expect(Delivery::kFrame);
  const std::uint64_t frames = frame_.info.sequence + 1;
  SetControl(kCapture, "Disconnect");
  ExpectLoss();
  ExpectRestart(frames);
}

TEST_F(V4l2, SettingsMayComeInAnyOrder) {
  LoadVivid(kWebcam);
  camera_ = OpenV4l2Camera(kCapture);
  camera_->Set("fps", "12.5");
  camera_->Set("height", "360");
  camera_->Set("width", "640");
  camera_->Set("pixel-format", "Mono8");
  camera_->Set("brightness", "77");
  camera_->Start(messages_);
  Expect(Delivery::kFrame);
  EXPECT_EQ(frame_.payload.size(), 640u * 360u);
  EXPECT_EQ(frame_.info.stride, 0);
  const nlohmann::json features = camera_->features();
  EXPECT_EQ(features["width"], 640);
  EXPECT_EQ(features["height"], 360);
  EXPECT_EQ(features["fps"], 12.5);
  EXPECT_EQ(features["pixel-format"], "Mono8");
  EXPECT_EQ(features["brightness"], 77);
  EXPECT_EQ(camera_->sensor()["bits"], 8);
  EXPECT_EQ(messages_.text, "");
}

TEST_F(V4l2, AnotherFrameRateThanAskedForIsSaid) {
  LoadVivid(kWebcam);
  camera_ = OpenV4l2Camera(kCapture);
  camera_->Set("fps", "12.5");
  camera_->Set("width", "1920");
  camera_->Set("height", "1080");  // so large pictures come more slowly
  camera_->Start(messages_);
  EXPECT_EQ(messages_.text, "the camera makes 5 frames/s where 12.5 were asked for\n");
}

TEST_F(V4l2, AnotherInputBringsItsOwnFormat) {
  LoadVivid(kWebcam);
  camera_ = OpenV4l2Camera(kCapture);
  camera_->Set("input", "3");
  camera_->Set("width", "64");  // no webcam has this
  camera_->Set("height", "48");
  camera_->Start(messages_);
  Expect(Delivery::kFrame);
  EXPECT_EQ(frame_.info.width, 64);
  EXPECT_EQ(frame_.payload.size(), 2u * 64 * 48);
}

TEST_F(V4l2, WhatTheCameraCannotDoIsRefusedWithAReason) {
  OpenWebcam();
  const auto error_of = [&](const std::string& feature, const std::string& value) {
    return ErrorOf([&] { camera_->Set(feature, value); });
  };
  EXPECT_EQ(error_of("width", "wide"), "this is not a number that the camera could take: width=wide");
  EXPECT_EQ(error_of("brightness", "7O"), "this is not a number that the camera could take: brightness=7O");
  EXPECT_EQ(error_of("brightness", "1000"), "the camera refuses this value: brightness=1000. From 0 to 255");
  EXPECT_EQ(
      error_of("brightnes", "1"),
      "the camera has no such feature: brightnes. Did you mean brightness? v4l2-ctl -L lists what it has");
  EXPECT_NE(error_of("pixel-format", "Mono9").find("It has Mono12, "), std::string::npos);
  EXPECT_EQ(error_of("fps", "-3"), "there is no such frame rate: fps=-3");
  EXPECT_EQ(error_of("input", "9"), "the camera has no such input (Invalid argument): 9");
  camera_->Set("width", "123");
  EXPECT_EQ(StartError(), "the camera makes Mono12 320x180 of what was asked for: /dev/video0");
}

TEST_F(V4l2, MirroredPicturesAreRefused) {
  OpenWebcam();
  camera_->Set("horizontal_flip", "1");
  EXPECT_NE(StartError().find("mirrored pictures"), std::string::npos);
  camera_->Set("horizontal_flip", "0");
  EXPECT_EQ(StartError(), "");
  Expect(Delivery::kFrame);
}

TEST_F(V4l2, AnInputWithoutASignalIsSaidAndStreamsOn) {
  LoadVivid(kHdmiCable);
  SetControl(kCapture, "DV Timings Signal Mode", 1);
  camera_ = OpenV4l2Camera(kCapture);
  camera_->Start(messages_);
  Expect(Delivery::kFrame);
  EXPECT_TRUE(Said("the camera says that no picture arrives at its input HDMI")) << messages_.text;
}

}  // namespace
}  // namespace polarscan::test
