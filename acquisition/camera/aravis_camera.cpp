// SPDX-License-Identifier: Apache-2.0
// The only file that knows Aravis.
#include "acquisition/camera/aravis_camera.h"

#include <arv.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <limits>

#include "acquisition/camera/pacer.h"
#include "acquisition/camera/returning_camera.h"
#include "core/descriptor.h"
#include "core/error.h"
#include "demosaic/pixel_format.h"

#if !ARAVIS_CHECK_VERSION(0, 8, 20)
#error "Aravis 0.8.20 or newer of the 0.8 series is needed"
#endif

namespace polarscan {
namespace {

constexpr int kSocketBuffer = 64 << 20, kSmallestPacket = 576, kLargestPacket = 16404;
constexpr std::chrono::seconds kTemperatureEvery{5};
constexpr guint kFrameRetention_us = 300'000, kPacketTimeout_us = 20'000;

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
template <class T>
using Object = std::unique_ptr<T, Unref>;

// A GError that turns into an Error.
class Failure {
 public:
  ~Failure() { g_clear_error(&error_); }
  GError** operator&() { return &error_; }
  explicit operator bool() const { return error_ != nullptr; }
  std::string text() const { return error_ ? error_->message : ""; }
  void Throw(const std::string& what, const std::string& where, const std::string& advice = "") const {
    if (error_) throw Error(fmt::format("{} ({})", what, error_->message), where, advice);
  }

 private:
  GError* error_ = nullptr;
};

std::string Text(const char* text) { return text ? text : ""; }

std::string ReasonOf(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_TIMEOUT:
      return "parts never came";
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return "parts are missing";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
      return "parts out of order";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return "size differs from what was announced";
    case ARV_BUFFER_STATUS_ABORTED:
      return "broken off";
    default:
      return "incomplete";
  }
}

// MTU of the interface that has this address; 1500 if it is not known.
int MtuOf(GSocketAddress* address) {
  sockaddr_in own{};
  if (!address || !g_socket_address_to_native(address, &own, sizeof own, nullptr)) return 1500;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return 1500;
  ifreq request{};
  for (const ifaddrs* i = list; i; i = i->ifa_next)
    if (i->ifa_addr && i->ifa_addr->sa_family == AF_INET &&
        reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr.s_addr == own.sin_addr.s_addr)
      std::strncpy(request.ifr_name, i->ifa_name, IFNAMSIZ - 1);
  ::freeifaddrs(list);
  const Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  return ::ioctl(socket.fd, SIOCGIFMTU, &request) == 0 ? request.ifr_mtu : 1500;
}

class AravisCamera : public ReturningCamera {
 public:
  explicit AravisCamera(const std::string& name) : name_(name) {
    Open(name);
    ReadInfo();
  }
  ~AravisCamera() override { AravisCamera::Close(); }

  CameraInfo info() const override { return info_; }

  nlohmann::json sensor() const override {
    nlohmann::json sensor = nlohmann::json::object();
    if (const auto format = FindPixelFormat(TextFeature("PixelFormat"))) sensor["bits"] = format->bits;
    return sensor;
  }

  nlohmann::json features() const override {
    static constexpr const char* kLogged[] = {"PixelFormat",
                                              "Width",
                                              "Height",
                                              "OffsetX",
                                              "OffsetY",
                                              "ReverseX",
                                              "ReverseY",
                                              "BinningHorizontal",
                                              "BinningVertical",
                                              "ExposureTime",
                                              "ExposureTimeAbs",
                                              "ExposureAuto",
                                              "Gain",
                                              "GainRaw",
                                              "GainAuto",
                                              "BalanceWhiteAuto",
                                              "BlackLevel",
                                              "BlackLevelRaw",
                                              "Gamma",
                                              "GammaEnable",
                                              "LUTEnable",
                                              "DigitalShift",
                                              "DefectCorrectionEnable",
                                              "SensorName",
                                              "DeviceTemperature",
                                              "AcquisitionFrameRate",
                                              "AcquisitionFrameRateEnable",
                                              "TriggerMode",
                                              "TriggerSource",
                                              "DeviceLinkThroughputLimit",
                                              "DeviceFirmwareVersion",
                                              "DeviceVersion",
                                              "PtpEnable",
                                              "PtpStatus",
                                              "GevSCPSPacketSize",
                                              "GevSCPD"};
    nlohmann::json values = nlohmann::json::object();
    for (const char* feature : kLogged)
      if (Has(feature)) values[feature] = TextFeature(feature);
    return values;
  }

  // As settings of the user's, so that a camera that returns gets them, too.
  void UseSoftwareTrigger() override {
    if (!Has("TriggerSoftware")) return Camera::UseSoftwareTrigger();
    if (Has("TriggerSelector")) Set("TriggerSelector", "FrameStart");
    Set("TriggerMode", "On");
    Set("TriggerSource", "Software");
  }
  void Trigger() override {
    Failure ignored;  // who waits for the frame asks again
    if (!control_lost_ && camera_) arv_camera_execute_command(camera_.get(), "TriggerSoftware", &ignored);
  }

  void Stop() override {
    if (stream_ && !control_lost_) arv_camera_stop_acquisition(camera_.get(), nullptr);
    stream_.reset();
  }

 protected:
  void Apply(const std::string& feature, const std::string& value) override {
    if (feature == "buffers") {
      buffers_ = std::clamp(std::atoi(value.c_str()), 2, 1000);
      return;
    }
    if (feature == "chunks") return SwitchChunksOn(value);
    if (!Has(feature.c_str()))
      throw Error("the camera has no such feature now", feature, "arv-tool-0.8 features lists what it has");
    Failure failure;
    arv_device_set_features_from_string(Device(), (feature + "=" + value).c_str(), &failure);
    failure.Throw("the camera refuses this value", feature + "=" + value);
  }

  void Begin(bool again) override {
    ChoosePixelFormat();
    SwitchAutomaticOff();
    RefuseWhatChangesTheLayout();
    const std::string format = TextFeature("PixelFormat");
    if (again && format != format_) throw Error("the camera came back with another pixel format", format);
    format_ = format;
    if (IsGige()) NegotiatePackets();
    StartStream();
  }

  Delivery Receive(Frame& frame, std::chrono::milliseconds timeout) override {
    if (control_lost_) {
      Leave("control lost");
      return Delivery::kNothing;
    }
    const Object<ArvBuffer> buffer(
        arv_stream_timeout_pop_buffer(stream_.get(), guint64(timeout.count()) * 1000));
    return buffer ? Take(buffer.get(), frame) : Delivery::kNothing;
  }

  void Close() override {
    if (!camera_) return;
    AravisCamera::Stop();
    g_signal_handlers_disconnect_by_data(Device(), this);
    camera_.reset();
  }

  // By serial number, since its address may be another one now.
  void Reopen() override {
    arv_update_device_list();
    std::string name;
    for (unsigned i = 0; i < arv_get_n_devices(); ++i)
      if (Text(arv_get_device_serial_nbr(i)) == info_.serial) name = Text(arv_get_device_id(i));
    Open(name.empty() ? name_ : name);
  }

 private:
  using Payload = std::vector<std::uint8_t>;

  // Opening.
  void Open(const std::string& name) {
    Failure failure;
    camera_.reset(arv_camera_new(name.c_str(), &failure));
    if (!camera_)
      throw Error(fmt::format("the camera cannot be opened ({})", failure ? failure.text() : "not found"),
                  name, "polarscan cameras lists those that can be seen; another program may hold it");
    if (arv_camera_is_uv_device(camera_.get()))
      arv_camera_uv_set_usb_mode(camera_.get(), ARV_UV_USB_MODE_ASYNC);
    if (IsGige() && !arv_gv_device_is_controller(ARV_GV_DEVICE(Device())))
      throw Error("another program controls this camera", name, "End it and try again");
    control_lost_ = false;
    g_signal_connect(Device(), "control-lost", G_CALLBACK(&AravisCamera::OnControlLost), this);
  }

  static void OnControlLost(ArvDevice*, gpointer self) {
    static_cast<AravisCamera*>(self)->control_lost_ = true;
  }

  void ReadInfo() {
    info_ = {name_, Text(arv_camera_get_vendor_name(camera_.get(), nullptr)),
             Text(arv_camera_get_model_name(camera_.get(), nullptr)),
             Text(arv_camera_get_device_serial_number(camera_.get(), nullptr))};
  }

  ArvDevice* Device() const { return arv_camera_get_device(camera_.get()); }
  bool IsGige() const { return arv_camera_is_gv_device(camera_.get()); }

  // Features.
  bool Has(const char* feature) const {
    Failure ignored;
    return arv_camera_is_feature_available(camera_.get(), feature, &ignored);
  }

  std::string TextFeature(const char* feature) const {
    ArvGcNode* node = arv_device_get_feature(Device(), feature);
    if (!node || !ARV_IS_GC_FEATURE_NODE(node)) return "";
    Failure ignored;
    if (ARV_IS_GC_ENUMERATION(node))
      return Text(arv_gc_enumeration_get_string_value(ARV_GC_ENUMERATION(node), &ignored));
    return Text(arv_gc_feature_node_get_value_as_string(ARV_GC_FEATURE_NODE(node), &ignored));
  }

  // names: separated by commas.
  void SwitchChunksOn(const std::string& names) {
    if (!arv_camera_are_chunks_available(camera_.get(), nullptr))
      throw Error("the camera cannot send values with its pictures (chunk data)", names);
    Failure failure;
    arv_camera_set_chunks(camera_.get(), names.c_str(), &failure);
    failure.Throw("the camera refuses to send these values with its pictures", names,
                  "arv-tool-0.8 features shows what ChunkSelector knows");
  }

  // NaN if the camera does not say.
  double FloatFeature(const char* feature) const {
    if (!Has(feature)) return std::numeric_limits<double>::quiet_NaN();
    Failure failure;
    const double value = arv_device_get_float_feature_value(Device(), feature, &failure);
    return failure ? std::numeric_limits<double>::quiet_NaN() : value;
  }

  // A value of the camera's that the user has not asked for.
  void Prefer(const char* feature, const std::string& value, const std::string& why) {
    if (IsSet(feature) || !Has(feature)) return;
    const std::string before = TextFeature(feature);
    if (before == value) return;
    Failure failure;
    arv_device_set_features_from_string(Device(), fmt::format("{}={}", feature, value).c_str(), &failure);
    if (failure) {
      progress().Warn(fmt::format("{} is {} and cannot be set to {}: {}", feature, before, value, why));
    } else {
      progress().Info(fmt::format("{} set from {} to {}: {}", feature, before, value, why));
    }
  }

  void ChoosePixelFormat() {
    if (IsSet("PixelFormat")) return;
    guint count = 0;
    const char** names = arv_camera_dup_available_pixel_formats_as_strings(camera_.get(), &count, nullptr);
    std::string best;
    int best_rank = -1;
    for (guint i = 0; i < count; ++i)
      if (const auto format = FindPixelFormat(names[i])) {
        // The most bits that sensors have (12), in the fewest bytes.
        const int rank = 4 * std::min(format->bits, 12) + (format->packing == Packing::kWords ? 0 : 1);
        if (rank > best_rank) best = names[i], best_rank = rank;
      }
    g_free(names);
    if (best.empty())
      throw Error("the camera offers no raw mosaic", info_.model,
                  "Look for a raw or polarized raw mode in its settings");
    Prefer("PixelFormat", best, "the deepest raw format");
  }

  void SwitchAutomaticOff() {
    for (const char* feature : {"ExposureAuto", "GainAuto", "BalanceWhiteAuto", "BlackLevelAuto"})
      Prefer(feature, "Off", "pictures of one set must be taken alike");
    for (const char* feature : {"GammaEnable", "LUTEnable"})
      Prefer(feature, "false", "pictures must be linear in light");
    if (Has("Gamma") && TextFeature("GammaEnable") != "false")
      Prefer("Gamma", "1", "pictures must be linear in light");
  }

  void RefuseWhatChangesTheLayout() const {
    for (const char* feature : {"OffsetX", "OffsetY"})
      if (Has(feature) && std::atoll(TextFeature(feature).c_str()) % 2 != 0)
        throw Error("an odd offset changes the polarizer layout",
                    fmt::format("{}={}", feature, TextFeature(feature)),
                    fmt::format("Use --set {}={}", feature, std::atoll(TextFeature(feature).c_str()) + 1));
    for (const char* feature : {"ReverseX", "ReverseY"})
      if (TextFeature(feature) == "true")
        throw Error("mirrored pictures turn the angles of polarization round", feature,
                    fmt::format("Use --set {}=false", feature));
  }

  // Streaming.
  void StartStream() {
    Failure failure;
    payload_bytes_ = arv_camera_get_payload(camera_.get(), &failure);
    failure.Throw("the camera does not say how large a frame is", info_.id);
    stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, &failure));
    failure.Throw("no stream from the camera", info_.id);
    if (ARV_IS_GV_STREAM(stream_.get()))
      g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
                   kSocketBuffer, "packet-resend", ARV_GV_STREAM_PACKET_RESEND_ALWAYS, "packet-timeout",
                   kPacketTimeout_us, "frame-retention", kFrameRetention_us, nullptr);
    for (int i = 0; i < buffers_; ++i) GiveBuffer({});
    numbers_ = FrameNumbers(IsGige());
    chunks_.reset(arv_camera_create_chunk_parser(camera_.get()));
    exposure_us_ = FloatFeature(Has("ExposureTime") ? "ExposureTime" : "ExposureTimeAbs");
    gain_db_ = FloatFeature("Gain");
    arv_camera_start_acquisition(camera_.get(), &failure);
    failure.Throw("the camera does not start", info_.id);
  }

  // The largest packets that get through whole: more than the MTU would be cut up on the way.
  void NegotiatePackets() {
    if (IsSet("GevSCPSPacketSize")) return;
    GSocketAddress* address = arv_gv_device_get_interface_address(ARV_GV_DEVICE(Device()));
    const int mtu = std::min(MtuOf(address), kLargestPacket);
    Failure failure;
    const int found = int(arv_camera_gv_auto_packet_size(camera_.get(), &failure));
    const int size = failure || found < kSmallestPacket ? std::min(mtu, 1500) : std::min(found, mtu);
    Failure ignored;
    arv_camera_gv_set_packet_size(camera_.get(), size, &ignored);
    progress().Info(fmt::format("packets of {} bytes", size));
  }

  void GiveBuffer(Payload memory) {
    auto* payload = new Payload(std::move(memory));
    payload->resize(payload_bytes_);
    arv_stream_push_buffer(stream_.get(),
                           arv_buffer_new_full(payload->size(), payload->data(), payload,
                                               [](gpointer p) { delete static_cast<Payload*>(p); }));
  }

  Delivery Take(ArvBuffer* buffer, Frame& frame) {
    const ArvBufferStatus status = arv_buffer_get_status(buffer);
    // Of a packet that belongs to no frame, say a late test packet. Newer versions of Aravis have a status
    // behind "aborted" for it.
    if (status == ARV_BUFFER_STATUS_CLEARED || status > ARV_BUFFER_STATUS_ABORTED) {
      GiveBuffer({});
      return Delivery::kNothing;
    }
    FrameInfo info;
    info.sequence = Number(numbers_.Unwrap(arv_buffer_get_frame_id(buffer)));
    info.camera_time_ns = std::int64_t(arv_buffer_get_timestamp(buffer));
    info.host_time_ns = HostTimeNs();
    info.pixel_format = format_;
    info.exposure_us = exposure_us_;
    info.gain_db = gain_db_;
    info.temperature_c = Temperature();
    std::string reason = status == ARV_BUFFER_STATUS_SUCCESS ? Describe(buffer, info) : ReasonOf(status);
    if (reason.empty()) {
      auto* payload = const_cast<Payload*>(static_cast<const Payload*>(arv_buffer_get_user_data(buffer)));
      const std::size_t bytes = PictureBytes(buffer, info);
      frame.payload.swap(*payload);
      GiveBuffer(std::move(*payload));
      frame.payload.resize(bytes);
      frame.info = info;
      return Delivery::kFrame;
    }
    GiveBuffer({});
    frame.info = info;
    frame.info.name = reason;
    return Delivery::kDamaged;
  }

  // Without what comes behind the picture.
  static std::size_t PictureBytes(ArvBuffer* buffer, const FrameInfo& info) {
    if (arv_buffer_has_chunks(buffer))
      return PayloadBytes(ParsePixelFormat(info.pixel_format), info.width, info.height,
                          std::size_t(info.stride));
    std::size_t bytes = 0;
    arv_buffer_get_image_data(buffer, &bytes);
    return bytes;
  }

  // What the camera says of this very picture.
  void ReadChunks(ArvBuffer* buffer, FrameInfo& info) {
    if (!arv_buffer_has_chunks(buffer)) return;
    for (const auto& [name, value] :
         {std::pair{"ChunkExposureTime", &info.exposure_us}, std::pair{"ChunkGain", &info.gain_db}}) {
      Failure failure;
      const double read = arv_chunk_parser_get_float_value(chunks_.get(), buffer, name, &failure);
      if (!failure) *value = read;
    }
  }

  // Asked for now and then: it takes a question to the camera.
  double Temperature() {
    const auto now = Clock::now();
    if (now >= next_temperature_) {
      temperature_c_ = FloatFeature("DeviceTemperature");
      next_temperature_ = now + kTemperatureEvery;
    }
    return temperature_c_;
  }

  // What is wrong with a whole buffer; fills in its size.
  std::string Describe(ArvBuffer* buffer, FrameInfo& info) {
    if (arv_buffer_get_payload_type(buffer) != ARV_BUFFER_PAYLOAD_TYPE_IMAGE) return "not a picture";
    ReadChunks(buffer, info);
    int x_padding = 0, y_padding = 0;
    info.width = arv_buffer_get_image_width(buffer);
    info.height = arv_buffer_get_image_height(buffer);
    arv_buffer_get_image_padding(buffer, &x_padding, &y_padding);
    const PixelFormat format = ParsePixelFormat(format_);
    if (x_padding > 0) info.stride = int(RowBytes(format, info.width)) + x_padding;
    const auto code = arv_buffer_get_image_pixel_format(buffer);
    if (!first_) first_ = Shape{code, info.width, info.height};
    if (*first_ != Shape{code, info.width, info.height}) return "the picture's format or size changed";
    std::size_t bytes = 0;
    arv_buffer_get_image_data(buffer, &bytes);
    if (bytes < PayloadBytes(format, info.width, info.height, std::size_t(info.stride)))
      return "too few bytes";
    return "";
  }

  struct Shape {
    std::uint32_t code;
    int width, height;
    bool operator==(const Shape&) const = default;
  };

  std::string name_, format_;
  CameraInfo info_;
  Object<ArvCamera> camera_;
  Object<ArvStream> stream_;
  Object<ArvChunkParser> chunks_;
  int buffers_ = 24;
  double exposure_us_ = 0, gain_db_ = 0, temperature_c_ = 0;  // NaN: unknown
  Clock::time_point next_temperature_;
  std::size_t payload_bytes_ = 0;
  FrameNumbers numbers_{true};
  std::optional<Shape> first_;
  std::atomic<bool> control_lost_ = false;
};

}  // namespace

std::vector<CameraInfo> ListAravisCameras() {
  arv_update_device_list();
  std::vector<CameraInfo> cameras;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i)
    cameras.push_back({Text(arv_get_device_id(i)), Text(arv_get_device_vendor(i)),
                       Text(arv_get_device_model(i)), Text(arv_get_device_serial_nbr(i))});
  return cameras;
}

std::unique_ptr<Camera> OpenAravisCamera(const std::string& name) {
  return std::make_unique<AravisCamera>(name);
}

}  // namespace polarscan
