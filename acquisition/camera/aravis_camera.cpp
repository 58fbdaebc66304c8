// SPDX-License-Identifier: Apache-2.0
// The only file that knows Aravis.
#include "acquisition/camera/aravis_camera.h"

#include <arpa/inet.h>
#include <arv.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <linux/filter.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <future>
#include <limits>
#include <span>
#include <thread>

#include "acquisition/camera/pacer.h"
#include "acquisition/camera/returning_camera.h"
#include "core/descriptor.h"
#include "core/error.h"
#include "core/files.h"
#include "core/options.h"
#include "core/words.h"
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
  bool NotFound() const { return g_error_matches(error_, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_FOUND); }
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

bool ToNative(GSocketAddress* address, sockaddr_in& native) {
  return address && g_socket_address_to_native(address, &native, sizeof native, nullptr);
}

// MTU of the interface that has this address; 1500 if it is not known.
int MtuOf(GSocketAddress* address) {
  sockaddr_in own{};
  if (!ToNative(address, own)) return 1500;
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

// Aravis does not show its socket: it is this process' UDP socket with the stream's port.
int SocketOf(std::uint16_t port) {
  constexpr int kMostDescriptors = 1 << 16;
  for (int fd = 0; fd < kMostDescriptors; ++fd) {
    int type = 0;
    sockaddr_in name{};
    socklen_t type_size = sizeof type, name_size = sizeof name;
    if (::getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &type_size) == 0 && type == SOCK_DGRAM &&
        ::getsockname(fd, reinterpret_cast<sockaddr*>(&name), &name_size) == 0 &&
        name.sin_family == AF_INET && ntohs(name.sin_port) == port)
      return fd;
  }
  throw Error("the socket of the stream is not to be found", std::to_string(port));
}

// Makes a UDP socket deaf to all hosts but this one; what lies in it already is thrown away.
void HearOnly(const sockaddr_in& host, int socket) {
  sock_filter code[] = {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, std::uint32_t(SKF_NET_OFF) + 12),  // source
                        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ntohl(host.sin_addr.s_addr), 0, 1),
                        BPF_STMT(BPF_RET | BPF_K, 0xffffffff), BPF_STMT(BPF_RET | BPF_K, 0)};
  const sock_fprog program{std::size(code), code};
  if (::setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) != 0)
    ThrowSystemError("cannot shut other hosts out of the stream", ::inet_ntoa(host.sin_addr));
  char byte = 0;
  while (::recv(socket, &byte, 1, MSG_DONTWAIT | MSG_TRUNC) >= 0) {
  }
}

class AravisCamera : public ReturningCamera {
 public:
  explicit AravisCamera(const std::string& name) : name_(name) {
    Adopt(name, Open(name));
    info_ = ReadInfo();
    hardware_ = HardwareAddress();
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
    if (!Has(feature.c_str())) {
      const std::string nearest = NearestName(feature, FeatureNames("Root"));
      throw Error("the camera has no such feature now", feature,
                  (nearest.empty() ? "" : "Did you mean " + nearest + "? ") +
                      "arv-tool-0.8 features lists what it has");
    }
    Failure failure;
    arv_device_set_features_from_string(Device(), (feature + "=" + value).c_str(), &failure);
    failure.Throw("the camera refuses this value", feature + "=" + value, AllowedValues(feature));
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

  // Its address may be another one now, and another camera may have the old one, or the same serial number.
  bool Reopen(std::chrono::milliseconds timeout) override {
    if (!search_.valid()) search_ = Search(name_, hardware_, info_.serial);
    if (search_.wait_for(timeout) != std::future_status::ready) return false;
    auto [name, camera] = search_.get();
    Adopt(name, std::move(camera));
    const CameraInfo found = ReadInfo();
    if ((!hardware_.empty() && HardwareAddress() != hardware_) || ToJson(found) != ToJson(info_))
      throw Error("another camera answers",
                  fmt::format("{}: {} {} {}", name, found.vendor, found.model, found.serial));
    return true;
  }

 private:
  using Payload = std::vector<std::uint8_t>;
  using Found = std::pair<std::string, Object<ArvCamera>>;

  // Opening.
  static Object<ArvCamera> Open(const std::string& name) {
    Failure failure;
    Object<ArvCamera> camera(arv_camera_new(name.c_str(), &failure));
    if (!camera && (!failure || failure.NotFound())) throw NoSuchCamera("the camera is not there", name);
    if (!camera)
      throw Error(fmt::format("the camera cannot be opened ({})", failure.text()), name,
                  "polarscan cameras lists those that can be seen; another program may hold it");
    return camera;
  }

  // On a thread of its own, because it takes seconds where nobody answers: who ends the recording need not
  // wait for it.
  static std::future<Found> Search(const std::string& name, const std::string& hardware,
                                   const std::string& serial) {
    auto task = std::make_shared<std::packaged_task<Found()>>([=] {
      arv_update_device_list();
      std::string now = name;
      for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
        if (!hardware.empty() && Text(arv_get_device_physical_id(i)) == hardware)
          now = Text(arv_get_device_address(i));
        if (hardware.empty() && Text(arv_get_device_serial_nbr(i)) == serial)
          now = Text(arv_get_device_id(i));
      }
      return Found(now, Open(now));
    });
    std::thread([task] { (*task)(); }).detach();
    return task->get_future();
  }

  void Adopt(const std::string& name, Object<ArvCamera> camera) {
    camera_ = std::move(camera);
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

  CameraInfo ReadInfo() const {
    return {name_, Text(arv_camera_get_vendor_name(camera_.get(), nullptr)),
            Text(arv_camera_get_model_name(camera_.get(), nullptr)),
            Text(arv_camera_get_device_serial_number(camera_.get(), nullptr))};
  }

  // Of a GigE camera, as Aravis lists it ("02:00:7f:00:00:01"); else nothing.
  std::string HardwareAddress() const {
    constexpr guint64 kHigh = 0x0008, kLow = 0x000C;  // bootstrap registers
    guint32 high = 0, low = 0;
    if (!IsGige() || !arv_device_read_register(Device(), kHigh, &high, nullptr) ||
        !arv_device_read_register(Device(), kLow, &low, nullptr))
      return "";
    return fmt::format("{:02x}:{:02x}:{:02x}:{:02x}:{:02x}:{:02x}", high >> 8 & 0xff, high & 0xff, low >> 24,
                       low >> 16 & 0xff, low >> 8 & 0xff, low & 0xff);
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

  // Of this category and those in it.
  std::vector<std::string> FeatureNames(const char* category) const {
    std::vector<std::string> names;
    ArvGcNode* node = arv_device_get_feature(Device(), category);
    if (!node || !ARV_IS_GC_CATEGORY(node)) return names;
    for (const GSList* i = arv_gc_category_get_features(ARV_GC_CATEGORY(node)); i; i = i->next) {
      const auto* name = static_cast<const char*>(i->data);
      if (ArvGcNode* feature = arv_device_get_feature(Device(), name);
          feature && ARV_IS_GC_CATEGORY(feature)) {
        for (std::string& below : FeatureNames(name)) names.push_back(std::move(below));
      } else {
        names.emplace_back(name);
      }
    }
    return names;
  }

  // "It is Off, On", "From 10 to 20"; empty if the camera does not say.
  std::string AllowedValues(const std::string& feature) const {
    Failure ignored;
    ArvGcNode* node = arv_device_get_feature(Device(), feature.c_str());
    if (node && ARV_IS_GC_ENUMERATION(node)) {
      guint count = 0;
      const char** names =
          arv_gc_enumeration_dup_available_string_values(ARV_GC_ENUMERATION(node), &count, &ignored);
      std::string text;
      for (guint i = 0; i < count; ++i) text += (text.empty() ? "It may be " : ", ") + Text(names[i]);
      g_free(names);
      return text;
    }
    if (node && ARV_IS_GC_BOOLEAN(node)) return "It may be true, false";
    if (node && ARV_IS_GC_FLOAT(node)) {
      double least = 0, most = 0;
      arv_device_get_float_feature_bounds(Device(), feature.c_str(), &least, &most, &ignored);
      return ignored ? "" : fmt::format("From {:g} to {:g}", least, most);
    }
    if (node && ARV_IS_GC_INTEGER(node)) {
      gint64 least = 0, most = 0;
      arv_device_get_integer_feature_bounds(Device(), feature.c_str(), &least, &most, &ignored);
      return ignored ? "" : fmt::format("From {} to {}", least, most);
    }
    return "";
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

  int IntegerFeature(const char* feature) const {
    Failure failure;
    const gint64 value = arv_device_get_integer_feature_value(Device(), feature, &failure);
    failure.Throw("the camera does not tell this", feature);
    return int(value);
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
    shape_ = {arv_camera_get_pixel_format(camera_.get(), &failure), IntegerFeature("Width"),
              IntegerFeature("Height")};
    failure.Throw("the camera does not say what its frames are", info_.id);
    IsGige() ? CreateGigeStream() : CreateStream();
    for (int i = 0; i < buffers_; ++i) GiveBuffer({});
    numbers_ = FrameNumbers(IsGige());
    chunks_.reset(arv_camera_create_chunk_parser(camera_.get()));
    exposure_us_ = FloatFeature(Has("ExposureTime") ? "ExposureTime" : "ExposureTimeAbs");
    gain_db_ = FloatFeature("Gain");
    arv_camera_start_acquisition(camera_.get(), &failure);
    failure.Throw("the camera does not start", info_.id);
  }

  void CreateStream() {
    Failure failure;
    stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, &failure));
    failure.Throw("no stream from the camera", info_.id);
  }

  // Aravis believes every packet that it sees, so it may see none but the camera's: not those of all the
  // machine (where it may open packet sockets it takes in whatever comes before its filter is set), nor those
  // that another camera still sends to a port that was somebody else's; and the camera must cut its frames
  // as Aravis puts them together.
  void CreateGigeStream() {
    arv_camera_gv_set_stream_options(camera_.get(), ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
    arv_camera_gv_set_packet_size_adjustment(camera_.get(), ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
    const int packet_size = PacketSize();
    CreateStream();
    if (PacketSize() != packet_size) throw Error("the camera changed the size of its packets", info_.id);
    g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size", 0,
                 "packet-resend", ARV_GV_STREAM_PACKET_RESEND_ALWAYS, "packet-timeout", kPacketTimeout_us,
                 "frame-retention", kFrameRetention_us, nullptr);
    sockaddr_in host{};
    if (!ToNative(arv_gv_device_get_device_address(ARV_GV_DEVICE(Device())), host))
      throw Error("the camera's address is not known", info_.id);
    arv_stream_stop_thread(stream_.get(), TRUE);
    const int socket = SocketOf(arv_gv_stream_get_port(ARV_GV_STREAM(stream_.get())));
    HearOnly(host, socket);
    if (::setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &kSocketBuffer, sizeof kSocketBuffer) != 0)
      ::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &kSocketBuffer, sizeof kSocketBuffer);
    arv_stream_start_thread(stream_.get());
  }

  int PacketSize() const {
    Failure failure;
    const int size = int(arv_camera_gv_get_packet_size(camera_.get(), &failure));
    failure.Throw("the camera does not say how large its packets are", info_.id);
    return size;
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
    progress().Info(fmt::format("packets of {} bytes", PacketSize()));
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
    // Its leader never came, so that nobody knows which frame it was; it shows as a gap.
    if (IsGige() && arv_buffer_get_frame_id(buffer) == 0) {
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
    if (shape_ != Shape{code, info.width, info.height}) return "the picture's format or size changed";
    std::size_t bytes = 0;
    const void* data = arv_buffer_get_image_data(buffer, &bytes);
    if (arv_buffer_has_chunks(buffer) && IsGige())
      bytes = FirstChunkBytes({static_cast<const std::uint8_t*>(data), bytes});
    if (bytes < PayloadBytes(format, info.width, info.height, std::size_t(info.stride)))
      return "too few bytes";
    return "";
  }

  // Each chunk has its length behind it, in its last four bytes; 0 if the lengths do not add up.
  static std::size_t FirstChunkBytes(std::span<const std::uint8_t> payload) {
    constexpr std::size_t kTag = 8;
    while (payload.size() >= kTag) {
      const std::span<const std::uint8_t> tag = payload.last(4);
      const std::size_t length = std::size_t(tag[0]) << 24 | tag[1] << 16 | tag[2] << 8 | tag[3];
      if (length + kTag == payload.size()) return length;
      if (length + kTag > payload.size()) return 0;
      payload = payload.first(payload.size() - kTag - length);
    }
    return 0;
  }

  struct Shape {
    std::uint32_t code = 0;
    int width = 0, height = 0;
    bool operator==(const Shape&) const = default;
  };

  std::string name_, format_, hardware_;
  CameraInfo info_;
  Object<ArvCamera> camera_;
  std::future<Found> search_;  // for the camera that is gone
  Object<ArvStream> stream_;
  Object<ArvChunkParser> chunks_;
  int buffers_ = 24;
  double exposure_us_ = 0, gain_db_ = 0, temperature_c_ = 0;  // NaN: unknown
  Clock::time_point next_temperature_;
  std::size_t payload_bytes_ = 0;
  FrameNumbers numbers_{true};
  Shape shape_;  // of every frame, as the camera is set
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
