// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>

#include "acquisition/camera/v4l2_camera.h"
#include "vivid.h"

namespace polarscan::test {

inline constexpr char kWebcam[] = "n_devs=1 node_types=0x1";
inline constexpr char kManyPlanes[] = "n_devs=1 node_types=0x1 multiplanar=2";
inline constexpr char kHdmiCable[] =
    "n_devs=1 node_types=0x101 num_inputs=1 input_types=3 num_outputs=1 output_types=1";

// Keeps what the camera says.
class Messages : public Progress {
 public:
  void Warn(const std::string& message) override { text += message + "\n"; }
  void Info(const std::string& message) override { text += message + "\n"; }
  std::string text;
};

class V4l2 : public testing::Test {
 protected:
  // Whatever failed before in here, the driver can go only when nothing of it is in use.
  void TearDown() override {
    camera_.reset();
    EXPECT_TRUE(UnloadVivid()) << "the camera left something open";
  }

  // A small webcam that is quick to simulate.
  void OpenWebcam() {
    LoadVivid(kWebcam);
    camera_ = OpenV4l2Camera(kCapture);
    camera_->Set("width", "320");
    camera_->Set("height", "180");
    camera_->Set("fps", "25");
  }
  void StartWebcam() {
    OpenWebcam();
    camera_->Start(messages_);
    Expect(Delivery::kFrame);
  }

  // The first thing that comes. Nothing here counts on a pace: the machine is slow, and slower beside others.
  Delivery Next(double limit_s = 20) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(limit_s);
    Delivery delivery = Delivery::kNothing;
    while (delivery == Delivery::kNothing && std::chrono::steady_clock::now() < end)
      delivery = camera_->Next(frame_, std::chrono::milliseconds(100));
    return delivery;
  }
  void Expect(Delivery delivery) {
    ASSERT_EQ(int(Next()), int(delivery)) << frame_.info.name << messages_.text;
  }
  // The camera lets go of the device and does not look for it at once.
  void ExpectLoss() {
    EXPECT_EQ(int(camera_->Next(frame_, std::chrono::milliseconds(100))), int(Delivery::kNothing));
    EXPECT_TRUE(Said("the camera is gone (No such device); looking for it")) << messages_.text;
    EXPECT_EQ(camera_->info().vendor, "vivid");
    EXPECT_NE(ErrorOf([&] { camera_->features(); }).find("the camera does not answer"), std::string::npos);
  }
  // Looking for it fails, and it says why.
  void ExpectVainSearch(const std::string& words) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!Said(words) && std::chrono::steady_clock::now() < end)
      ASSERT_EQ(int(Next(0.1)), int(Delivery::kNothing));
    EXPECT_TRUE(Said(words)) << messages_.text;
  }
  // The camera comes back by itself, and its frames are numbered on.
  void ExpectRestart(std::uint64_t frames_before) {
    Delivery delivery = Next();
    for (; delivery == Delivery::kFrame; delivery = Next()) frames_before = frame_.info.sequence + 1;
    ASSERT_EQ(int(delivery), int(Delivery::kRestarted)) << messages_.text;
    EXPECT_EQ(frame_.info.sequence, frames_before);
    EXPECT_NE(frame_.info.name.find("camera gone for"), std::string::npos) << frame_.info.name;
    EXPECT_TRUE(Said("the camera is back after")) << messages_.text;
    Expect(Delivery::kFrame);
    EXPECT_EQ(frame_.info.sequence, frames_before);
    EXPECT_EQ(frame_.info.width, 320);
    EXPECT_EQ(frame_.info.height, 180);
    EXPECT_EQ(frame_.payload.size(), 2u * 320 * 180);
  }
  bool Said(const std::string& words) const { return messages_.text.find(words) != std::string::npos; }

  // What the camera says when it throws; empty if it does not.
  template <class F>
  static std::string ErrorOf(F act) {
    try {
      act();
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  std::string StartError() {
    return ErrorOf([&] { camera_->Start(messages_); });
  }

  void ExpectExactPictures(std::uint32_t code, const std::string& name, int width, int height, int rate,
                           int count);

  std::unique_ptr<Camera> camera_;
  Messages messages_;
  Frame frame_;
};

}  // namespace polarscan::test
