// SPDX-License-Identifier: Apache-2.0
// The memory into which the driver writes pictures.
#pragma once
#include <linux/videodev2.h>
#include <sys/mman.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "acquisition/camera/v4l2/device.h"

namespace polarscan::v4l2 {

// What is told and asked about a buffer; the same for both ways of capturing.
class BufferTalk {
 public:
  BufferTalk(std::uint32_t type, std::uint32_t index) {
    buffer_.index = index;
    buffer_.type = type;
    buffer_.memory = V4L2_MEMORY_MMAP;
  }
  // False: errno says why.
  bool Do(int fd, unsigned long request) {
    if (planar()) buffer_.m.planes = &plane_, buffer_.length = 1;
    return Ask(fd, request, &buffer_) == 0;
  }
  // The buffer's size, and where to map it.
  std::size_t length() const { return planar() ? plane_.length : buffer_.length; }
  off_t place() const { return off_t(planar() ? plane_.m.mem_offset : buffer_.m.offset); }
  // Where the picture ends and begins in the buffer.
  std::size_t bytes() const { return planar() ? plane_.bytesused : buffer_.bytesused; }
  std::size_t first() const { return planar() ? plane_.data_offset : 0; }
  const v4l2_buffer& operator*() const { return buffer_; }

 private:
  bool planar() const { return buffer_.type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }
  v4l2_buffer buffer_{};
  v4l2_plane plane_{};
};

// The driver's buffers, mapped. A mapping keeps the device open, so none may outlive a failure.
class Buffers {
 public:
  Buffers(int fd, std::uint32_t type) : fd_(fd), type_(type) {}
  // Throws Error if the driver gives none; device: its name for that.
  void Allocate(int count, const std::string& device) {
    v4l2_requestbuffers request{};
    request.count = std::uint32_t(count);
    request.type = type_;
    request.memory = V4L2_MEMORY_MMAP;
    if (Ask(fd_, VIDIOC_REQBUFS, &request) < 0) ThrowRefusal("the camera gives no buffers", device);
    for (std::uint32_t i = 0; i < request.count; ++i) {
      BufferTalk buffer(type_, i);
      if (!buffer.Do(fd_, VIDIOC_QUERYBUF)) ThrowRefusal("the camera gives no buffers", device);
      void* memory = ::mmap(nullptr, buffer.length(), PROT_READ, MAP_SHARED, fd_, buffer.place());
      if (memory == MAP_FAILED) ThrowRefusal("the camera's buffers cannot be mapped", device);
      memory_.emplace_back(static_cast<const std::uint8_t*>(memory), buffer.length());
    }
    for (std::uint32_t i = 0; i < request.count; ++i)
      if (!Give(i)) ThrowRefusal("the camera takes no buffers", device);
  }
  ~Buffers() {
    for (const auto& part : memory_) ::munmap(const_cast<std::uint8_t*>(part.data()), part.size());
    v4l2_requestbuffers none{};
    none.type = type_;
    none.memory = V4L2_MEMORY_MMAP;
    Ask(fd_, VIDIOC_REQBUFS, &none);
  }
  Buffers(const Buffers&) = delete;
  Buffers& operator=(const Buffers&) = delete;

  // Lets the driver fill it. False: errno says why.
  bool Give(std::uint32_t index) const { return BufferTalk(type_, index).Do(fd_, VIDIOC_QBUF); }
  std::span<const std::uint8_t> operator[](std::uint32_t index) const { return memory_.at(index); }

 private:
  int fd_;
  std::uint32_t type_;
  std::vector<std::span<const std::uint8_t>> memory_;
};

}  // namespace polarscan::v4l2
