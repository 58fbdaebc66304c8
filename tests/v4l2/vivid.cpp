// SPDX-License-Identifier: Apache-2.0
#include "vivid.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace polarscan::test {
namespace {

constexpr char kModule[] = "/modules/vivid.ko";

void Require(bool good, const std::string& what) {
  if (!good) throw std::runtime_error(what + ": " + std::strerror(errno));
}

void Do(const Descriptor& device, unsigned long request, void* argument, const std::string& what) {
  Require(::ioctl(device.fd, request, argument) == 0, what);
}

void WriteTo(const std::string& path, const std::string& text) {
  const Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  Require(file.fd >= 0 && ::write(file.fd, text.data(), text.size()) == ssize_t(text.size()), path);
}

v4l2_buffer BufferOf(std::uint32_t type, std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = type;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

std::uint32_t RequestBuffers(const Descriptor& device, std::uint32_t type, std::uint32_t count) {
  v4l2_requestbuffers request{};
  request.type = type;
  request.memory = V4L2_MEMORY_MMAP;
  request.count = count;
  Do(device, VIDIOC_REQBUFS, &request, "REQBUFS");
  return request.count;
}

}  // namespace

void LoadVivid(const std::string& options) {
  const Descriptor file(::open(kModule, O_RDONLY | O_CLOEXEC));
  Require(file.fd >= 0 && ::syscall(SYS_finit_module, file.fd, options.c_str(), 0) == 0, kModule);
}

bool UnloadVivid() { return ::syscall(SYS_delete_module, "vivid", O_NONBLOCK) == 0; }

void PlugOut() { WriteTo("/sys/bus/platform/drivers/vivid/unbind", "vivid.0"); }
void PlugIn() { WriteTo("/sys/bus/platform/drivers/vivid/bind", "vivid.0"); }

Descriptor Open(const std::string& device) {
  Descriptor file(::open(device.c_str(), O_RDWR | O_CLOEXEC));
  Require(file.fd >= 0, device);
  return file;
}

void SetControl(const std::string& device, const std::string& name, int value) {
  const Descriptor file = Open(device);
  v4l2_queryctrl control{};
  do {
    control.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    Do(file, VIDIOC_QUERYCTRL, &control, name);
  } while (name != reinterpret_cast<const char*>(control.name));
  v4l2_control setting{control.id, value};
  Do(file, VIDIOC_S_CTRL, &setting, name);
}

void StartStreaming(const Descriptor& device) {
  const std::uint32_t count = RequestBuffers(device, V4L2_BUF_TYPE_VIDEO_CAPTURE, 2);
  for (std::uint32_t i = 0; i < count; ++i) {
    v4l2_buffer buffer = BufferOf(V4L2_BUF_TYPE_VIDEO_CAPTURE, i);
    Do(device, VIDIOC_QBUF, &buffer, "QBUF");
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  Do(device, VIDIOC_STREAMON, &type, "STREAMON");
}

// VESA's CVT with reduced blanking, version 2, for slow pictures: of the blank lines the fewest allowed.
void SetTimings(const std::string& device, int width, int height, int rate) {
  v4l2_dv_timings timings{};
  timings.type = V4L2_DV_BT_656_1120;
  v4l2_bt_timings& bt = timings.bt;
  bt.width = std::uint32_t(width), bt.height = std::uint32_t(height);
  bt.polarities = V4L2_DV_HSYNC_POS_POL;
  bt.hfrontporch = 8, bt.hsync = 32, bt.hbackporch = 40;
  bt.vfrontporch = 1, bt.vsync = 8, bt.vbackporch = 6;
  bt.standards = V4L2_DV_BT_STD_CVT;
  bt.pixelclock = std::uint64_t(width + 80) * std::uint64_t(height + 15) * std::uint64_t(rate) / 1000 * 1000;
  Do(Open(device), VIDIOC_S_DV_TIMINGS, &timings, "timings of " + device);
}

std::vector<std::uint8_t> SentPicture(std::uint64_t n, std::size_t bytes) {
  std::vector<std::uint64_t> words((bytes + 7) / 8);
  std::uint64_t state = n;
  for (std::uint64_t& word : words) {  // splitmix64 without its last steps: quick on a simulated processor
    state += 0x9E3779B97F4A7C15;
    word = (state ^ (state >> 30)) * 0xBF58476D1CE4E5B9;
  }
  words.at(0) = n;
  std::vector<std::uint8_t> picture(bytes);
  std::memcpy(picture.data(), words.data(), bytes);
  return picture;
}

Sender::Sender(std::uint32_t pixel_format, int width, int height) : file_(Open(kOutput)) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  format.fmt.pix.width = std::uint32_t(width), format.fmt.pix.height = std::uint32_t(height);
  format.fmt.pix.pixelformat = pixel_format;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  Do(file_, VIDIOC_S_FMT, &format, "output format");
  bytes_ = format.fmt.pix.sizeimage;
  const std::uint32_t count = RequestBuffers(file_, V4L2_BUF_TYPE_VIDEO_OUTPUT, 3);
  for (std::uint32_t i = 0; i < count; ++i) {
    v4l2_buffer buffer = BufferOf(V4L2_BUF_TYPE_VIDEO_OUTPUT, i);
    Do(file_, VIDIOC_QUERYBUF, &buffer, "QUERYBUF");
    mapped_ = buffer.length;
    void* memory = ::mmap(nullptr, mapped_, PROT_WRITE, MAP_SHARED, file_.fd, off_t(buffer.m.offset));
    Require(memory != MAP_FAILED, "output buffer");
    memory_.push_back(static_cast<std::uint8_t*>(memory));
    Give(i);
  }
  int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  Do(file_, VIDIOC_STREAMON, &type, "output STREAMON");
  thread_ = std::thread([this] { Run(); });
}

Sender::~Sender() {
  stop_ = true;
  thread_.join();
  for (std::uint8_t* memory : memory_) ::munmap(memory, mapped_);
}

void Sender::Give(std::uint32_t index) {
  const std::vector<std::uint8_t> picture = SentPicture(sent_, bytes_);
  std::memcpy(memory_.at(index), picture.data(), bytes_);
  v4l2_buffer buffer = BufferOf(V4L2_BUF_TYPE_VIDEO_OUTPUT, index);
  buffer.field = V4L2_FIELD_NONE;
  buffer.bytesused = std::uint32_t(bytes_);
  Do(file_, VIDIOC_QBUF, &buffer, "output QBUF");
  ++sent_;
}

void Sender::Run() {
  while (!stop_) {
    pollfd ready{file_.fd, POLLOUT, 0};
    if (::poll(&ready, 1, 100) <= 0) continue;
    v4l2_buffer buffer = BufferOf(V4L2_BUF_TYPE_VIDEO_OUTPUT, 0);
    Do(file_, VIDIOC_DQBUF, &buffer, "output DQBUF");
    Give(buffer.index);
  }
}

}  // namespace polarscan::test
