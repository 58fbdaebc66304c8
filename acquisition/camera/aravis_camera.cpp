// SPDX-License-Identifier: Apache-2.0
// Only this and aravis/ know Aravis.
#include "acquisition/camera/aravis_camera.h"

#include <arv.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <future>

#include "acquisition/camera/aravis/features.h"
#include "acquisition/camera/aravis/frame_from_buffer.h"
#include "acquisition/camera/aravis/gige_stream.h"
#include "acquisition/camera/aravis/glib_objects.h"
#include "acquisition/camera/aravis/open.h"
#include "acquisition/camera/aravis/preferred_settings.h"
#include "acquisition/camera/frame_numbers.h"
#include "acquisition/camera/pacer.h"
#include "acquisition/camera/returning_camera.h"
#include "core/error.h"
#include "demosaic/sensor/pixel_format.h"

namespace polarscan {
namespace {

constexpr std::chrono::seconds kTemperatureEvery{5};

class AravisCamera : public ReturningCamera {
 public:
  explicit AravisCamera(const std::string& name) : name_(name) {
    Adopt(name, aravis::Open(name));
    info_ = ReadInfo();
    hardware_ = aravis::HardwareAddress(camera_.get());
  }
  ~AravisCamera() override { AravisCamera::Close(); }

  CameraInfo info() const override { return info_; }

  nlohmann::json sensor() const override {
    nlohmann::json sensor = nlohmann::json::object();
    if (const auto format = FindPixelFormat(Value("PixelFormat"))) sensor["bits"] = format->bits;
    return sensor;
  }

  nlohmann::json features() const override { return aravis::LoggedFeatures(camera_.get()); }

  // As settings of the user's, so that a camera that returns gets them, too.
  void UseSoftwareTrigger() override {
    if (!Has("TriggerSoftware")) return Camera::UseSoftwareTrigger();
    if (Has("TriggerSelector")) Set("TriggerSelector", "FrameStart");
    Set("TriggerMode", "On");
    Set("TriggerSource", "Software");
  }
  void Trigger() override {
    aravis::Failure ignored;  // who waits for the frame asks again
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
    } else if (feature == "chunks") {
      aravis::SwitchChunksOn(camera_.get(), value);
    } else {
      aravis::SetFeature(camera_.get(), feature, value);
    }
  }

  void Begin(bool again) override {
    const aravis::PreferredSettings preferred{
        camera_.get(), [&](const std::string& feature) { return IsSet(feature); }, progress()};
    aravis::ChoosePixelFormat(preferred, info_.model);
    aravis::SwitchAutomaticOff(preferred);
    aravis::RefuseWhatChangesTheLayout(camera_.get());
    const std::string format = Value("PixelFormat");
    if (again && format != shape_.pixel_format)
      throw Error("the camera came back with another pixel format", format);
    shape_.pixel_format = format;
    if (IsGige() && !IsSet("GevSCPSPacketSize")) {
      aravis::NegotiatePackets(camera_.get());
      progress().Info(fmt::format("packets of {} bytes", aravis::PacketSize(camera_.get(), info_.id)));
    }
    StartStream();
  }

  Delivery Receive(Frame& frame, std::chrono::milliseconds timeout) override {
    if (control_lost_) {
      Leave("control lost");
      return Delivery::kNothing;
    }
    const aravis::Object<ArvBuffer> buffer(
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
    if (!search_.valid()) search_ = aravis::Search(name_, hardware_, info_.serial);
    if (search_.wait_for(timeout) != std::future_status::ready) return false;
    auto [name, camera] = search_.get();
    Adopt(name, std::move(camera));
    const CameraInfo found = ReadInfo();
    const bool other = !hardware_.empty() && aravis::HardwareAddress(camera_.get()) != hardware_;
    if (other || ToJson(found) != ToJson(info_))
      throw Error("another camera answers",
                  fmt::format("{}: {} {} {}", name, found.vendor, found.model, found.serial));
    return true;
  }

 private:
  // Opening.
  void Adopt(const std::string& name, aravis::Object<ArvCamera> camera) {
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
    return {name_, aravis::Text(arv_camera_get_vendor_name(camera_.get(), nullptr)),
            aravis::Text(arv_camera_get_model_name(camera_.get(), nullptr)),
            aravis::Text(arv_camera_get_device_serial_number(camera_.get(), nullptr))};
  }

  ArvDevice* Device() const { return arv_camera_get_device(camera_.get()); }
  bool IsGige() const { return arv_camera_is_gv_device(camera_.get()); }
  bool Has(const char* feature) const { return aravis::HasFeature(camera_.get(), feature); }
  std::string Value(const char* feature) const { return aravis::TextFeature(camera_.get(), feature); }

  // Streaming.
  void StartStream() {
    aravis::Failure failure;
    payload_bytes_ = arv_camera_get_payload(camera_.get(), &failure);
    failure.Throw("the camera does not say how large a frame is", info_.id);
    shape_ = {shape_.pixel_format, arv_camera_get_pixel_format(camera_.get(), &failure),
              aravis::IntegerFeature(camera_.get(), "Width"), aravis::IntegerFeature(camera_.get(), "Height"),
              IsGige()};
    failure.Throw("the camera does not say what its frames are", info_.id);
    IsGige() ? CreateGigeStream() : CreateStream();
    for (int i = 0; i < buffers_; ++i) GiveBuffer({});
    numbers_ = FrameNumbers(IsGige());
    chunks_.reset(arv_camera_create_chunk_parser(camera_.get()));
    exposure_us_ =
        aravis::FloatFeature(camera_.get(), Has("ExposureTime") ? "ExposureTime" : "ExposureTimeAbs");
    gain_db_ = aravis::FloatFeature(camera_.get(), "Gain");
    arv_camera_start_acquisition(camera_.get(), &failure);
    failure.Throw("the camera does not start", info_.id);
  }

  void CreateStream() {
    aravis::Failure failure;
    stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, &failure));
    failure.Throw("no stream from the camera", info_.id);
  }

  void CreateGigeStream() {
    const int packet_size = aravis::PrepareGigeStream(camera_.get(), info_.id);
    CreateStream();
    aravis::GuardGigeStream(camera_.get(), stream_.get(), packet_size, info_.id);
  }

  void GiveBuffer(aravis::Payload memory) {
    auto* payload = new aravis::Payload(std::move(memory));
    payload->resize(payload_bytes_);
    arv_stream_push_buffer(stream_.get(),
                           arv_buffer_new_full(payload->size(), payload->data(), payload,
                                               [](gpointer p) { delete static_cast<aravis::Payload*>(p); }));
  }

  Delivery Take(ArvBuffer* buffer, Frame& frame) {
    if (!aravis::HoldsAFrame(buffer, shape_)) {
      GiveBuffer({});
      return Delivery::kNothing;
    }
    FrameInfo info = NumberAndTimes(buffer);
    info.name = aravis::WhatIsWrong(buffer, shape_, chunks_.get(), info);
    const bool whole = info.name.empty();
    GiveBuffer(whole ? aravis::TakePicture(buffer, info, frame.payload) : aravis::Payload());
    frame.info = info;
    return whole ? Delivery::kFrame : Delivery::kDamaged;
  }

  // With everything else that does not depend on the picture.
  FrameInfo NumberAndTimes(ArvBuffer* buffer) {
    FrameInfo info;
    info.sequence = Number(numbers_.Unwrap(arv_buffer_get_frame_id(buffer)));
    info.camera_time_ns = std::int64_t(arv_buffer_get_timestamp(buffer));
    info.host_time_ns = HostTimeNs();
    info.pixel_format = shape_.pixel_format;
    info.exposure_us = exposure_us_;
    info.gain_db = gain_db_;
    info.temperature_c = Temperature();
    return info;
  }

  // Asked for now and then: it takes a question to the camera.
  double Temperature() {
    const auto now = Clock::now();
    if (now >= next_temperature_) {
      temperature_c_ = aravis::FloatFeature(camera_.get(), "DeviceTemperature");
      next_temperature_ = now + kTemperatureEvery;
    }
    return temperature_c_;
  }

  std::string name_, hardware_;
  CameraInfo info_;
  aravis::Object<ArvCamera> camera_;
  std::future<aravis::Found> search_;  // for the camera that is gone
  aravis::Object<ArvStream> stream_;
  aravis::Object<ArvChunkParser> chunks_;
  int buffers_ = 24;
  double exposure_us_ = 0, gain_db_ = 0, temperature_c_ = 0;  // NaN: unknown
  Clock::time_point next_temperature_;
  std::size_t payload_bytes_ = 0;
  FrameNumbers numbers_{true};
  aravis::FrameShape shape_;
  std::atomic<bool> control_lost_ = false;
};

}  // namespace

std::unique_ptr<Camera> OpenAravisCamera(const std::string& name) {
  return std::make_unique<AravisCamera>(name);
}

}  // namespace polarscan
