// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <linux/videodev2.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "core/files/descriptor.h"

namespace polarscan::test {

// The kernel's imaginary video device, as the tests need it. All functions throw std::runtime_error when the
// kernel says no, if not said otherwise.

inline constexpr char kCapture[] = "/dev/video0", kOutput[] = "/dev/video1";

// Options: https://docs.kernel.org/admin-guide/media/vivid.html
void LoadVivid(const std::string& options);
// False if somebody still holds it.
bool UnloadVivid();
// As if the device were pulled out and plugged in. While somebody still holds the old /dev/video0, the new
// one gets another number.
void PlugOut();
void PlugIn();

// A control by the name that the driver gives it ("Disconnect"). The device is closed again.
void SetControl(const std::string& device, const std::string& name, int value = 1);

// An open device, to be in the way of others.
Descriptor Open(const std::string& device);
void StartStreaming(const Descriptor& device);

// Sets width, height and frames per second of both ends of the HDMI cable.
void SetTimings(const std::string& device, int width, int height, int rate);

// The bytes of the n-th picture sent: random, with n in the first eight.
std::vector<std::uint8_t> SentPicture(std::uint64_t n, std::size_t bytes);

// Sends pictures, each another, into the output, until it is destroyed. They come out of the capture device
// if both have the same timings, format and size, and its controls osd_text_mode=2 and loop_video=1
// (Linux 6.1); else it makes pictures of its own, without a word.
class Sender {
 public:
  Sender(std::uint32_t pixel_format, int width, int height);
  ~Sender();
  std::uint64_t sent() const { return sent_; }

 private:
  void Give(std::uint32_t index);
  void Run();

  Descriptor file_;
  std::vector<std::uint8_t*> memory_;
  std::size_t bytes_ = 0, mapped_ = 0;
  std::atomic<std::uint64_t> sent_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace polarscan::test
