// SPDX-License-Identifier: Apache-2.0
#include "acquisition/camera/v4l2_camera.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>

#include "acquisition/camera/pacer.h"
#include "acquisition/camera/returning_camera.h"
#include "core/descriptor.h"
#include "core/error.h"
#include "core/options.h"
#include "core/words.h"
#include "demosaic/pixel_format.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// The raw formats, deepest first (16 bits are most often 12 in a larger container). Linux 6.1 has no names
// for two of them.
struct Fourcc {
  std::uint32_t code;
  const char* name;
};
constexpr Fourcc kFormats[] = {{V4L2_PIX_FMT_Y14, "Mono14"},
                               {V4L2_PIX_FMT_SRGGB14, "BayerRG14"},
                               {V4L2_PIX_FMT_SGRBG14, "BayerGR14"},
                               {V4L2_PIX_FMT_SGBRG14, "BayerGB14"},
                               {V4L2_PIX_FMT_SBGGR14, "BayerBG14"},
                               {v4l2_fourcc('Y', '1', '4', 'P'), "Mono14csi2p"},
                               {V4L2_PIX_FMT_SRGGB14P, "BayerRG14csi2p"},
                               {V4L2_PIX_FMT_SGRBG14P, "BayerGR14csi2p"},
                               {V4L2_PIX_FMT_SGBRG14P, "BayerGB14csi2p"},
                               {V4L2_PIX_FMT_SBGGR14P, "BayerBG14csi2p"},
                               {V4L2_PIX_FMT_Y12, "Mono12"},
                               {V4L2_PIX_FMT_SRGGB12, "BayerRG12"},
                               {V4L2_PIX_FMT_SGRBG12, "BayerGR12"},
                               {V4L2_PIX_FMT_SGBRG12, "BayerGB12"},
                               {V4L2_PIX_FMT_SBGGR12, "BayerBG12"},
                               {v4l2_fourcc('Y', '1', '2', 'P'), "Mono12csi2p"},
                               {V4L2_PIX_FMT_SRGGB12P, "BayerRG12csi2p"},
                               {V4L2_PIX_FMT_SGRBG12P, "BayerGR12csi2p"},
                               {V4L2_PIX_FMT_SGBRG12P, "BayerGB12csi2p"},
                               {V4L2_PIX_FMT_SBGGR12P, "BayerBG12csi2p"},
                               {V4L2_PIX_FMT_Y16, "Mono16"},
                               {V4L2_PIX_FMT_SRGGB16, "BayerRG16"},
                               {V4L2_PIX_FMT_SGRBG16, "BayerGR16"},
                               {V4L2_PIX_FMT_SGBRG16, "BayerGB16"},
                               {V4L2_PIX_FMT_SBGGR16, "BayerBG16"},
                               {V4L2_PIX_FMT_Y10, "Mono10"},
                               {V4L2_PIX_FMT_SRGGB10, "BayerRG10"},
                               {V4L2_PIX_FMT_SGRBG10, "BayerGR10"},
                               {V4L2_PIX_FMT_SGBRG10, "BayerGB10"},
                               {V4L2_PIX_FMT_SBGGR10, "BayerBG10"},
                               {V4L2_PIX_FMT_Y10P, "Mono10csi2p"},
                               {V4L2_PIX_FMT_SRGGB10P, "BayerRG10csi2p"},
                               {V4L2_PIX_FMT_SGRBG10P, "BayerGR10csi2p"},
                               {V4L2_PIX_FMT_SGBRG10P, "BayerGB10csi2p"},
                               {V4L2_PIX_FMT_SBGGR10P, "BayerBG10csi2p"},
                               {V4L2_PIX_FMT_GREY, "Mono8"},
                               {V4L2_PIX_FMT_SRGGB8, "BayerRG8"},
                               {V4L2_PIX_FMT_SGRBG8, "BayerGR8"},
                               {V4L2_PIX_FMT_SGBRG8, "BayerGB8"},
                               {V4L2_PIX_FMT_SBGGR8, "BayerBG8"}};

int Ask(int fd, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ::ioctl(fd, request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

// For what the system just said in errno.
[[noreturn]] void ThrowRefusal(const std::string& what, const std::string& where) {
  const int code = errno;
  std::string advice;
  if (code == EBUSY) advice = "Another program uses the camera; end it first";
  if (code == EACCES || code == EPERM) advice = "Members of the group \"video\" may usually open cameras";
  throw Error(fmt::format("{} ({})", what, std::strerror(code)), where, advice);
}

template <class T>
T NumberOf(const std::string& feature, const std::string& text) {
  T number{};
  const char* end = text.data() + text.size();
  const auto [rest, code] = std::from_chars(text.data(), end, number);
  if (code != std::errc() || rest != end)
    throw Error("this is not a number that the camera could take", fmt::format("{}={}", feature, text));
  return number;
}

template <class T>
std::string TextOf(const T& text) {
  return reinterpret_cast<const char*>(text);
}

// As v4l2-ctl does it: "Exposure Time, Absolute" is exposure_time_absolute.
std::string ControlName(const std::string& name) {
  std::string result;
  for (const unsigned char c : name) {
    if (std::isalnum(c))
      result += char(std::tolower(c));
    else if (!result.empty() && result.back() != '_')
      result += '_';
  }
  while (result.ends_with('_')) result.pop_back();
  return result;
}

// type: V4L2_BUF_TYPE_VIDEO_CAPTURE or V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE.
std::vector<const Fourcc*> OfferedFormats(int fd, std::uint32_t type) {
  std::set<std::uint32_t> codes;
  v4l2_fmtdesc description{};
  description.type = type;
  for (; Ask(fd, VIDIOC_ENUM_FMT, &description) == 0; ++description.index)
    codes.insert(description.pixelformat);
  std::vector<const Fourcc*> offered;
  for (const Fourcc& format : kFormats)
    if (codes.contains(format.code)) offered.push_back(&format);
  return offered;
}

// How the device captures: V4L2_BUF_TYPE_VIDEO_CAPTURE, where it must be V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE
// (raw pictures have one plane in both), 0 where it does not.
std::uint32_t CaptureType(const v4l2_capability& capability) {
  const std::uint32_t can =
      capability.capabilities & V4L2_CAP_DEVICE_CAPS ? capability.device_caps : capability.capabilities;
  if (!(can & V4L2_CAP_STREAMING)) return 0;
  if (can & V4L2_CAP_VIDEO_CAPTURE) return V4L2_BUF_TYPE_VIDEO_CAPTURE;
  return can & V4L2_CAP_VIDEO_CAPTURE_MPLANE ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : 0;
}

// What is told and asked about a buffer; the same for both ways of capturing.
class BufferTalk {
 public:
  BufferTalk(std::uint32_t type, std::uint32_t index) {
    buffer_.index = index;
    buffer_.type = type;
    buffer_.memory = V4L2_MEMORY_MMAP;
  }
  bool Do(int fd, unsigned long request) {
    if (planar()) buffer_.m.planes = &plane_, buffer_.length = 1;
    return Ask(fd, request, &buffer_) == 0;
  }
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

  bool Give(std::uint32_t index) const { return BufferTalk(type_, index).Do(fd_, VIDIOC_QBUF); }
  std::span<const std::uint8_t> operator[](std::uint32_t index) const { return memory_.at(index); }

 private:
  int fd_;
  std::uint32_t type_;
  std::vector<std::span<const std::uint8_t>> memory_;
};

class V4l2Camera : public ReturningCamera {
 public:
  explicit V4l2Camera(const std::string& device) : device_(device) { Open(); }
  ~V4l2Camera() override { V4l2Camera::Stop(); }

  CameraInfo info() const override {
    return {device_, TextOf(capability_.driver), TextOf(capability_.card), TextOf(capability_.bus_info)};
  }
  nlohmann::json sensor() const override { return {{"bits", ParsePixelFormat(FormatName()).bits}}; }

  nlohmann::json features() const override {
    v4l2_capability still{};
    if (Ask(fd(), VIDIOC_QUERYCAP, &still) < 0) ThrowRefusal("the camera does not answer", device_);
    nlohmann::json values = {{"pixel-format", FormatName()},
                             {"width", picture_.width},
                             {"height", picture_.height},
                             {"fps", FramesPerSecond()},
                             {"buffers", buffer_count_}};
    for (const auto& [name, control] : Controls()) {
      v4l2_control value{control.id, 0};
      if (Ask(fd(), VIDIOC_G_CTRL, &value) == 0) values[name] = value.value;
    }
    return values;
  }

  void Stop() override {
    if (!buffers_) return;
    Ask(fd(), VIDIOC_STREAMOFF, &type_);
    buffers_.reset();
  }

 protected:
  // Sizes are checked when the stream begins, because many cameras know pairs of width and height only.
  void Apply(const std::string& feature, const std::string& value) override {
    if (feature == "pixel-format") {
      wanted_.pixelformat = CodeOf(value);
      ChooseFormat();
    } else if (feature == "width" || feature == "height") {
      (feature == "width" ? wanted_.width : wanted_.height) = NumberOf<std::uint32_t>(feature, value);
      ChooseFormat();
    } else if (feature == "fps") {
      fps_ = NumberOf<double>(feature, value);
      SetFramesPerSecond(*fps_);
    } else if (feature == "input") {
      int input = NumberOf<int>(feature, value);
      if (Ask(fd(), VIDIOC_S_INPUT, &input) < 0) ThrowRefusal("the camera has no such input", value);
      ChooseFormat();
    } else if (feature == "buffers") {
      buffer_count_ = std::clamp(NumberOf<int>(feature, value), 2, 32);
    } else {
      SetControl(feature, NumberOf<std::int32_t>(feature, value));
    }
  }

  void Begin(bool again) override {
    if (again) wanted_ = started_;
    ChooseFormat();  // other settings may have changed it
    CheckFormat();
    CheckLayout();
    ChooseRate();
    WarnWithoutSignal();
    auto buffers = std::make_unique<Buffers>(fd(), type_);
    buffers->Allocate(buffer_count_, device_);
    if (Ask(fd(), VIDIOC_STREAMON, &type_) < 0) ThrowRefusal("the camera does not start", device_);
    buffers_ = std::move(buffers);
    started_ = picture_;
    first_.reset();
  }

  Delivery Receive(Frame& frame, std::chrono::milliseconds timeout) override {
    pollfd ready{fd(), POLLIN, 0};
    const int n = ::poll(&ready, 1, int(timeout.count()));
    if (n == 0 || (n < 0 && errno == EINTR)) return Delivery::kNothing;
    BufferTalk buffer(type_, 0);
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
    if (file_->fd < 0) ThrowRefusal("the camera cannot be opened", device_);
    type_ = Ask(fd(), VIDIOC_QUERYCAP, &capability_) < 0 ? 0 : CaptureType(capability_);
    if (type_ == 0)
      throw Error("this is no video capture device", device_,
                  "polarscan cameras lists those that can be seen");
    const auto offered = OfferedFormats(fd(), type_);
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
    if (Ask(fd(), VIDIOC_G_FMT, &format) < 0) ThrowRefusal("the camera does not tell its format", device_);
    v4l2_pix_format& single = format.fmt.pix;
    v4l2_pix_format_mplane& planar = format.fmt.pix_mp;
    const bool is_single = type_ == V4L2_BUF_TYPE_VIDEO_CAPTURE;
    is_single ? SetWanted(single) : SetWanted(planar);
    if (is_single) {
      single.bytesperline = single.sizeimage = 0;
    } else {
      planar.num_planes = 1, planar.plane_fmt[0] = {};
    }
    if (Ask(fd(), VIDIOC_S_FMT, &format) < 0) ThrowRefusal("the camera refuses the format", device_);
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
      throw Error(fmt::format("the camera makes {} {}x{} of what was asked for", FormatName(), picture_.width,
                              picture_.height),
                  device_);
  }

  std::string FormatName() const {
    for (const Fourcc& format : kFormats)
      if (format.code == picture_.pixelformat) return format.name;
    return "another format";
  }

  std::map<std::string, v4l2_queryctrl> Controls() const {
    std::map<std::string, v4l2_queryctrl> controls;
    v4l2_queryctrl control{};
    control.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    while (Ask(fd(), VIDIOC_QUERYCTRL, &control) == 0) {
      const bool valued = control.type != V4L2_CTRL_TYPE_CTRL_CLASS && control.type != V4L2_CTRL_TYPE_BUTTON;
      if (valued && !(control.flags & V4L2_CTRL_FLAG_DISABLED))
        controls[ControlName(TextOf(control.name))] = control;
      control.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    }
    return controls;
  }

  double FramesPerSecond() const {
    v4l2_streamparm parameters{};
    parameters.type = type_;
    if (Ask(fd(), VIDIOC_G_PARM, &parameters) < 0) return 0;
    const v4l2_fract time = parameters.parm.capture.timeperframe;
    return time.numerator ? double(time.denominator) / time.numerator : 0;
  }

  std::uint32_t CodeOf(const std::string& name) const {
    std::string offered;
    for (const Fourcc* format : OfferedFormats(fd(), type_)) {
      if (name == format->name) return format->code;
      offered += std::string(offered.empty() ? "" : ", ") + format->name;
    }
    throw Error("the camera has no such pixel format", name, "It has " + offered);
  }

  void SetFramesPerSecond(double rate) {
    if (!(rate > 0 && rate < 1e6)) throw Error("there is no such frame rate", fmt::format("fps={}", rate));
    v4l2_streamparm parameters{};
    parameters.type = type_;
    parameters.parm.capture.timeperframe = {1000, std::uint32_t(std::lround(1000 * rate))};
    if (Ask(fd(), VIDIOC_S_PARM, &parameters) < 0) ThrowRefusal("the camera refuses the frame rate", device_);
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

  void SetControl(const std::string& name, std::int32_t value) {
    const auto controls = Controls();
    const auto found = controls.find(name);
    if (found == controls.end()) {
      std::vector<std::string> names = {"pixel-format", "width", "height", "fps", "input", "buffers"};
      for (const auto& [known, control] : controls) names.push_back(known);
      const std::string nearest = NearestName(name, names);
      throw Error(
          "the camera has no such feature", name,
          (nearest.empty() ? "" : "Did you mean " + nearest + "? ") + "v4l2-ctl -L lists what it has");
    }
    v4l2_control control{found->second.id, value};
    const bool outside = found->second.type == V4L2_CTRL_TYPE_INTEGER &&
                         (value < found->second.minimum || value > found->second.maximum);
    if (outside || Ask(fd(), VIDIOC_S_CTRL, &control) < 0)  // the kernel itself would take the nearest
      throw Error("the camera refuses this value", fmt::format("{}={}", name, value),
                  fmt::format("From {} to {}", found->second.minimum, found->second.maximum));
  }

  // Odd offsets of the crop and mirrored pictures change the polarizer layout.
  void CheckLayout() const {
    v4l2_selection crop{};
    crop.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    crop.target = V4L2_SEL_TGT_CROP;
    if (Ask(fd(), VIDIOC_G_SELECTION, &crop) == 0 && (crop.r.left % 2 != 0 || crop.r.top % 2 != 0))
      throw Error("an odd offset changes the polarizer layout",
                  fmt::format("crop at {},{}", crop.r.left, crop.r.top));
    for (const std::uint32_t id : {V4L2_CID_HFLIP, V4L2_CID_VFLIP}) {
      v4l2_control flip{id, 0};
      if (Ask(fd(), VIDIOC_G_CTRL, &flip) == 0 && flip.value)
        throw Error("mirrored pictures turn the angles of polarization round", device_,
                    "Switch horizontal_flip and vertical_flip off");
    }
  }

  void WarnWithoutSignal() const {
    v4l2_input input{};
    if (Ask(fd(), VIDIOC_G_INPUT, &input.index) < 0 || Ask(fd(), VIDIOC_ENUMINPUT, &input) < 0) return;
    if (input.status & (V4L2_IN_ST_NO_POWER | V4L2_IN_ST_NO_SIGNAL | V4L2_IN_ST_NO_SYNC))
      progress().Warn("the camera says that no picture arrives at its input " + TextOf(input.name));
  }

  Delivery Take(const BufferTalk& talk, Frame& frame) {
    const v4l2_buffer& buffer = *talk;
    if (!first_) first_ = buffer.sequence;
    FrameInfo& info = frame.info;
    info = {};
    info.sequence = Number(buffer.sequence - *first_);
    info.camera_time_ns =
        std::int64_t(buffer.timestamp.tv_sec) * 1'000'000'000 + buffer.timestamp.tv_usec * 1000;
    info.host_time_ns = HostTimeNs();
    info.pixel_format = FormatName();
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
  std::unique_ptr<Buffers> buffers_;
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
    if (file.fd < 0 || Ask(file.fd, VIDIOC_QUERYCAP, &capability) < 0) continue;
    const std::uint32_t type = CaptureType(capability);
    if (type == 0 || OfferedFormats(file.fd, type).empty()) continue;
    cameras.push_back({ByIdLink(entry.path()), TextOf(capability.driver), TextOf(capability.card),
                       TextOf(capability.bus_info)});
  }
  std::ranges::sort(cameras, {}, &CameraInfo::id);
  return cameras;
}

std::unique_ptr<Camera> OpenV4l2Camera(const std::string& device) {
  return std::make_unique<V4l2Camera>(device);
}

}  // namespace polarscan
