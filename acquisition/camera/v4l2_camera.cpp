// SPDX-License-Identifier: Apache-2.0
// Its parts in v4l2/ are headers: the guest program of tests/v4l2 is built of this source and few others.
#include "acquisition/camera/v4l2_camera.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
#include <span>

#include "acquisition/camera/pacer.h"
#include "acquisition/camera/returning_camera.h"
#include "acquisition/camera/v4l2/buffers.h"
#include "acquisition/camera/v4l2/controls.h"
#include "acquisition/camera/v4l2/device.h"
#include "acquisition/camera/v4l2/formats.h"
#include "core/error.h"
#include "core/files/descriptor.h"
#include "demosaic/sensor/pixel_format.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

template <class T>
T NumberOf(const std::string& feature, const std::string& text) {
  T number{};
  const char* end = text.data() + text.size();
  const auto [rest, code] = std::from_chars(text.data(), end, number);
  if (code != std::errc() || rest != end)
    throw Error("this is not a number that the camera could take", fmt::format("{}={}", feature, text));
  return number;
}

class V4l2Camera : public ReturningCamera {
 public:
  explicit V4l2Camera(const std::string& device) : device_(device) { Open(); }
  ~V4l2Camera() override { V4l2Camera::Stop(); }

  CameraInfo info() const override {
    return {device_, v4l2::TextOf(capability_.driver), v4l2::TextOf(capability_.card),
            v4l2::TextOf(capability_.bus_info)};
  }
  nlohmann::json sensor() const override {
    return {{"bits", ParsePixelFormat(v4l2::FormatName(picture_.pixelformat)).bits}};
  }

  nlohmann::json features() const override {
    v4l2_capability still{};
    if (v4l2::Ask(fd(), VIDIOC_QUERYCAP, &still) < 0)
      v4l2::ThrowRefusal("the camera does not answer", device_);
    nlohmann::json values = {{"pixel-format", v4l2::FormatName(picture_.pixelformat)},
                             {"width", picture_.width},
                             {"height", picture_.height},
                             {"fps", FramesPerSecond()},
                             {"buffers", buffer_count_}};
    for (const auto& [name, control] : v4l2::Controls(fd())) {
      v4l2_control value{control.id, 0};
      if (v4l2::Ask(fd(), VIDIOC_G_CTRL, &value) == 0) values[name] = value.value;
    }
    return values;
  }

  void Stop() override {
    if (!buffers_) return;
    v4l2::Ask(fd(), VIDIOC_STREAMOFF, &type_);
    buffers_.reset();
  }

 protected:
  // Sizes are checked when the stream begins, because many cameras know pairs of width and height only.
  void Apply(const std::string& feature, const std::string& value) override {
    if (feature == "pixel-format") {
      wanted_.pixelformat = v4l2::CodeOf(fd(), type_, value);
      ChooseFormat();
    } else if (feature == "width" || feature == "height") {
      (feature == "width" ? wanted_.width : wanted_.height) = NumberOf<std::uint32_t>(feature, value);
      ChooseFormat();
    } else if (feature == "fps") {
      fps_ = NumberOf<double>(feature, value);
      SetFramesPerSecond(*fps_);
    } else if (feature == "input") {
      int input = NumberOf<int>(feature, value);
      if (v4l2::Ask(fd(), VIDIOC_S_INPUT, &input) < 0)
        v4l2::ThrowRefusal("the camera has no such input", value);
      ChooseFormat();
    } else if (feature == "buffers") {
      buffer_count_ = std::clamp(NumberOf<int>(feature, value), 2, 32);
    } else {
      v4l2::SetControl(fd(), feature, NumberOf<std::int32_t>(feature, value));
    }
  }

  void Begin(bool again) override {
    if (again) wanted_ = started_;
    ChooseFormat();  // other settings may have changed it
    CheckFormat();
    v4l2::CheckLayout(fd(), device_);
    ChooseRate();
    WarnWithoutSignal();
    auto buffers = std::make_unique<v4l2::Buffers>(fd(), type_);
    buffers->Allocate(buffer_count_, device_);
    if (v4l2::Ask(fd(), VIDIOC_STREAMON, &type_) < 0)
      v4l2::ThrowRefusal("the camera does not start", device_);
    buffers_ = std::move(buffers);
    started_ = picture_;
    first_.reset();
  }

  Delivery Receive(Frame& frame, std::chrono::milliseconds timeout) override {
    pollfd ready{fd(), POLLIN, 0};
    const int n = ::poll(&ready, 1, int(timeout.count()));
    if (n == 0 || (n < 0 && errno == EINTR)) return Delivery::kNothing;
    v4l2::BufferTalk buffer(type_, 0);
    if (!buffer.Do(fd(), VIDIOC_DQBUF)) {
      if (errno != EAGAIN) Leave(std::strerror(errno));
      return Delivery::kNothing;
    }
    const Delivery delivery = Take(buffer, frame);
    if (!buffers_->Give((*buffer).index)) Leave(std::strerror(errno));
    return delivery;
  }

  void Close() override {
    V4l2Camera::Stop();
    file_.reset();
  }
  bool Reopen(std::chrono::milliseconds) override {
    Open();
    return true;
  }

 private:
  int fd() const { return file_ ? file_->fd : -1; }

  void Open() {
    file_ = std::make_unique<Descriptor>(::open(device_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
    if (file_->fd < 0 && errno == ENOENT)
      throw NoSuchCamera("the camera cannot be opened (No such file or directory)", device_);
    if (file_->fd < 0) v4l2::ThrowRefusal("the camera cannot be opened", device_);
    type_ = v4l2::Ask(fd(), VIDIOC_QUERYCAP, &capability_) < 0 ? 0 : v4l2::CaptureType(capability_);
    if (type_ == 0)
      throw Error("this is no video capture device", device_,
                  "polarscan cameras lists those that can be seen");
    const auto offered = v4l2::OfferedFormats(fd(), type_);
    if (offered.empty())
      throw Error("the camera offers no raw mosaic", device_,
                  "It should offer GREY, Y10, Y12, Y14, Y16 or raw Bayer, as words or packed");
    wanted_ = {};
    wanted_.pixelformat = offered.front()->code;
    ChooseFormat();
  }

  // Asks for what is wanted. The driver changes what it does not like instead of refusing it.
  void ChooseFormat() {
    v4l2_format format{};
    format.type = type_;
    if (v4l2::Ask(fd(), VIDIOC_G_FMT, &format) < 0)
      v4l2::ThrowRefusal("the camera does not tell its format", device_);
    v4l2_pix_format& single = format.fmt.pix;
    v4l2_pix_format_mplane& planar = format.fmt.pix_mp;
    const bool is_single = type_ == V4L2_BUF_TYPE_VIDEO_CAPTURE;
    is_single ? SetWanted(single) : SetWanted(planar);
    if (is_single) {
      single.bytesperline = single.sizeimage = 0;
    } else {
      planar.num_planes = 1, planar.plane_fmt[0] = {};
    }
    if (v4l2::Ask(fd(), VIDIOC_S_FMT, &format) < 0)
      v4l2::ThrowRefusal("the camera refuses the format", device_);
    if (!is_single && planar.num_planes != 1)
      throw Error(fmt::format("the camera sends a picture in {} parts", int(planar.num_planes)), device_,
                  "Only raw pictures in one part (plane) can be recorded");
    is_single ? ReadFormat(single, single.bytesperline)
              : ReadFormat(planar, planar.plane_fmt[0].bytesperline);
  }

  template <class Format>
  void SetWanted(Format& format) const {
    format.pixelformat = wanted_.pixelformat;
    if (wanted_.width) format.width = wanted_.width;
    if (wanted_.height) format.height = wanted_.height;
    format.field = V4L2_FIELD_NONE;
  }
  template <class Format>
  void ReadFormat(const Format& format, std::uint32_t row_bytes) {
    picture_ = {};
    picture_.pixelformat = format.pixelformat;
    picture_.width = format.width, picture_.height = format.height;
    picture_.bytesperline = row_bytes;
  }

  void CheckFormat() const {
    if (picture_.pixelformat != wanted_.pixelformat || (wanted_.width && picture_.width != wanted_.width) ||
        (wanted_.height && picture_.height != wanted_.height))
      throw Error(fmt::format("the camera makes {} {}x{} of what was asked for",
                              v4l2::FormatName(picture_.pixelformat), picture_.width, picture_.height),
                  device_);
  }

  double FramesPerSecond() const {
    v4l2_streamparm parameters{};
    parameters.type = type_;
    if (v4l2::Ask(fd(), VIDIOC_G_PARM, &parameters) < 0) return 0;
    const v4l2_fract time = parameters.parm.capture.timeperframe;
    return time.numerator ? double(time.denominator) / time.numerator : 0;
  }

  void SetFramesPerSecond(double rate) {
    if (!(rate > 0 && rate < 1e6)) throw Error("there is no such frame rate", fmt::format("fps={}", rate));
    v4l2_streamparm parameters{};
    parameters.type = type_;
    parameters.parm.capture.timeperframe = {1000, std::uint32_t(std::lround(1000 * rate))};
    if (v4l2::Ask(fd(), VIDIOC_S_PARM, &parameters) < 0)
      v4l2::ThrowRefusal("the camera refuses the frame rate", device_);
  }

  // A format brings a rate of its own, and may not know the one that is wanted.
  void ChooseRate() {
    if (!fps_) return;
    SetFramesPerSecond(*fps_);
    const double rate = FramesPerSecond();
    if (std::abs(rate - *fps_) > 0.01 * *fps_)
      progress().Warn(
          fmt::format("the camera makes {:.6g} frames/s where {:.6g} were asked for", rate, *fps_));
  }

  void WarnWithoutSignal() const {
    v4l2_input input{};
    if (v4l2::Ask(fd(), VIDIOC_G_INPUT, &input.index) < 0 || v4l2::Ask(fd(), VIDIOC_ENUMINPUT, &input) < 0)
      return;
    if (input.status & (V4L2_IN_ST_NO_POWER | V4L2_IN_ST_NO_SIGNAL | V4L2_IN_ST_NO_SYNC))
      progress().Warn("the camera says that no picture arrives at its input " + v4l2::TextOf(input.name));
  }

  Delivery Take(const v4l2::BufferTalk& talk, Frame& frame) {
    const v4l2_buffer& buffer = *talk;
    if (!first_) first_ = buffer.sequence;
    FrameInfo& info = frame.info;
    info = {};
    info.sequence = Number(buffer.sequence - *first_);
    info.camera_time_ns =
        std::int64_t(buffer.timestamp.tv_sec) * 1'000'000'000 + buffer.timestamp.tv_usec * 1000;
    info.host_time_ns = HostTimeNs();
    info.pixel_format = v4l2::FormatName(picture_.pixelformat);
    info.width = int(picture_.width), info.height = int(picture_.height);
    const PixelFormat format = ParsePixelFormat(info.pixel_format);
    if (std::size_t(picture_.bytesperline) * picture_.height != PayloadBytes(format, info.width, info.height))
      info.stride = int(picture_.bytesperline);
    const std::size_t needed = PayloadBytes(format, info.width, info.height, std::size_t(info.stride));
    const std::span<const std::uint8_t> memory = (*buffers_)[buffer.index];
    const std::size_t end = std::min(talk.bytes(), memory.size()), begin = std::min(talk.first(), end);
    if (buffer.flags & V4L2_BUF_FLAG_ERROR) info.name = "marked as damaged by the driver";
    if (info.name.empty() && end - begin < needed) info.name = "too few bytes";
    if (!info.name.empty()) return Delivery::kDamaged;
    const auto data = memory.subspan(begin, needed);
    frame.payload.assign(data.begin(), data.end());
    return Delivery::kFrame;
  }

  std::string device_;
  std::unique_ptr<Descriptor> file_;
  v4l2_capability capability_{};
  std::uint32_t type_ = 0;                 // V4L2_BUF_TYPE_...: how it captures
  v4l2_pix_format wanted_{};               // pixelformat, width and height; 0: any
  v4l2_pix_format picture_{}, started_{};  // what is set; what the stream began with
  std::optional<double> fps_;
  int buffer_count_ = 8;
  std::unique_ptr<v4l2::Buffers> buffers_;
  std::optional<std::uint32_t> first_;  // the driver's number of the first frame since (re)start
};

std::string ByIdLink(const fs::path& device) {
  std::error_code code;
  for (const auto& entry : fs::directory_iterator("/dev/v4l/by-id", code))
    if (fs::canonical(entry.path(), code) == device) return entry.path().string();
  return device.string();
}

}  // namespace

std::vector<CameraInfo> ListV4l2Cameras() {
  std::vector<CameraInfo> cameras;
  std::error_code code;
  for (const auto& entry : fs::directory_iterator("/dev", code)) {
    if (!entry.path().filename().string().starts_with("video")) continue;
    const Descriptor file(::open(entry.path().c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
    v4l2_capability capability{};
    if (file.fd < 0 || v4l2::Ask(file.fd, VIDIOC_QUERYCAP, &capability) < 0) continue;
    const std::uint32_t type = v4l2::CaptureType(capability);
    if (type == 0 || v4l2::OfferedFormats(file.fd, type).empty()) continue;
    cameras.push_back({ByIdLink(entry.path()), v4l2::TextOf(capability.driver), v4l2::TextOf(capability.card),
                       v4l2::TextOf(capability.bus_info)});
  }
  std::ranges::sort(cameras, {}, &CameraInfo::id);
  return cameras;
}

std::unique_ptr<Camera> OpenV4l2Camera(const std::string& device) {
  return std::make_unique<V4l2Camera>(device);
}

}  // namespace polarscan
