// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "acquisition/camera/aravis_camera.h"
#include "acquisition/capture.h"
#include "session_helpers.h"
#include "simulation/gige/gige_server.h"
#include "simulation/gige/protocol.h"
#include "simulation/simulated_camera.h"

namespace polarscan::test {

inline SimulatedCameraOptions SmallScene(const std::string& format, double fps) {
  SimulatedCameraOptions options;
  options.simulator.width = 256, options.simulator.height = 192;
  options.simulator.rings = "33:3";
  options.simulator.samples = 1;
  options.simulator.scene.scene = "sphere";
  options.simulator.scene.table = options.simulator.scene.blocks = false;
  options.pixel_format = format;
  options.fps = fps;
  return options;
}

// Another camera, changed in something.
class CameraAround : public Camera {
 public:
  explicit CameraAround(const SimulatedCameraOptions& options) : camera_(OpenSimulatedCamera(options)) {}
  CameraInfo info() const override { return camera_->info(); }
  nlohmann::json sensor() const override { return camera_->sensor(); }
  nlohmann::json features() const override { return camera_->features(); }
  void Set(const std::string& feature, const std::string& value) override { camera_->Set(feature, value); }
  void Start(Progress& progress) override { camera_->Start(progress); }
  void Stop() override { camera_->Stop(); }
  Delivery Next(Frame& frame, std::chrono::milliseconds timeout) override {
    return camera_->Next(frame, timeout);
  }

 private:
  std::unique_ptr<Camera> camera_;
};

// A simulated camera whose exposure grows from frame to frame.
class ChangingExposure : public CameraAround {
 public:
  using CameraAround::CameraAround;
  Delivery Next(Frame& frame, std::chrono::milliseconds timeout) override {
    const Delivery delivery = CameraAround::Next(frame, timeout);
    frame.info.exposure_us = 1000.5 + double(frame.info.sequence);
    return delivery;
  }
};

// Remembers the payloads that it gave, in their order.
class RememberingCamera : public CameraAround {
 public:
  using CameraAround::CameraAround;
  Delivery Next(Frame& frame, std::chrono::milliseconds timeout) override {
    const Delivery delivery = CameraAround::Next(frame, timeout);
    const std::lock_guard lock(mutex_);
    if (delivery == Delivery::kFrame) given_.push_back(frame.payload);
    return delivery;
  }
  std::vector<Bytes> given() const {
    const std::lock_guard lock(mutex_);
    return given_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<Bytes> given_;
};

// A camera at an address of its own, so that tests may run side by side.
class ServedCamera {
 public:
  ServedCamera(const SimulatedCameraOptions& options, const GigeServerOptions& gige,
               std::unique_ptr<Camera> camera = nullptr, int other = 0)
      : camera_(Started(camera ? std::move(camera) : OpenSimulatedCamera(options))),
        server_({*camera_,
                 options.simulator.width,
                 options.simulator.height,
                 {options.pixel_format},
                 options.fps,
                 [this](const std::string& format, double fps) {
                   camera_->Set("pixel-format", format);
                   camera_->Set("fps", fmt::format("{}", fps));
                 }},
                Address(other), gige),
        thread_([this] { server_.Run(stop_); }) {}
  ~ServedCamera() {
    stop_.Cancel();
    thread_.join();
  }
  // other: of another camera of the same test.
  static std::string Address(int other = 0) {
    return fmt::format("127.{}.{}.{}", 1 + getpid() / 65536 % 100 + 100 * other, getpid() / 256 % 256,
                       getpid() % 256);
  }
  GigeCounts counts() const { return server_.counts(); }

 private:
  // Its pictures are ready, so that a client gets frames at once.
  static std::unique_ptr<Camera> Started(std::unique_ptr<Camera> camera) {
    Progress silent;
    camera->Start(silent);
    return camera;
  }

  std::unique_ptr<Camera> camera_;
  Progress stop_;
  GigeServer server_;
  std::thread thread_;
};

class GigeTest : public SessionFolder {
 protected:
  // Records `frames` frames and holds every stored one against what the camera sent under its number.
  FrameCounts RecordAndCompare(const SimulatedCameraOptions& options, const GigeServerOptions& gige,
                               int frames, double seconds = 60) {
    auto remembering = std::make_unique<RememberingCamera>(options);
    const RememberingCamera& camera = *remembering;
    const ServedCamera served(options, gige, std::move(remembering));
    const std::unique_ptr<Camera> client = OpenAravisCamera(ServedCamera::Address());
    FrameCounts counts = Capture(*client, session(), nlohmann::json::object(),
                                 {.frames = frames, .seconds = seconds}, {}, listener_)
                             .counts;
    const Session recorded = OpenSession(session(), Verify::kPayloads);
    EXPECT_TRUE(recorded.damage.empty());
    EXPECT_EQ(recorded.frames.size(), counts.stored);
    const std::vector<Bytes> sent = camera.given();
    std::size_t next = 0;  // the first that may come
    for (std::size_t i = 0; i < recorded.frames.size(); ++i) {
      const Frame frame = ReadFrame(recorded, i);
      // A camera that a busy machine lost for a moment begins anew; ours goes on counting.
      std::size_t at = frame.info.sequence;
      if (counts.restarts > 0)
        at = std::size_t(
            std::find(sent.begin() + std::ptrdiff_t(std::min(next, sent.size())), sent.end(), frame.payload) -
            sent.begin());
      EXPECT_TRUE(at < sent.size() && frame.payload == sent[at])
          << Difference(frame, sent) << listener_.words();
      next = at + 1;
    }
    resent_ = served.counts().resent;
    return counts;
  }

  // In words, for who must find out where a payload comes from.
  static std::string Difference(const Frame& frame, const std::vector<Bytes>& sent) {
    std::string text =
        fmt::format("frame {}: {} bytes, {} x {}, {} ns by the camera's clock; ", frame.info.sequence,
                    frame.payload.size(), frame.info.width, frame.info.height, frame.info.camera_time_ns);
    if (frame.info.sequence < sent.size()) {
      const Bytes& wanted = sent[frame.info.sequence];
      const auto [a, b] = std::ranges::mismatch(frame.payload, wanted);
      text += fmt::format("the camera sent {} bytes, other ones from byte {} on; ", wanted.size(),
                          a - frame.payload.begin());
    } else {
      text += fmt::format("the camera sent only {}; ", sent.size());
    }
    const auto same = std::ranges::find(sent, frame.payload);
    return text + (same == sent.end() ? "like none that it sent\n"
                                      : fmt::format("like its frame {}\n", same - sent.begin()));
  }

  static std::vector<Bytes> Sent(SimulatedCameraOptions options, int frames) {
    options.fps = 10000;
    const std::unique_ptr<Camera> camera = OpenSimulatedCamera(options);
    Progress silent;
    camera->Start(silent);
    std::vector<Bytes> payloads;
    Frame frame;
    while (int(payloads.size()) < frames)
      if (camera->Next(frame, std::chrono::seconds(1)) == Delivery::kFrame) payloads.push_back(frame.payload);
    return payloads;
  }

  // Keeps what is said.
  class Listener : public Progress {
   public:
    void Warn(const std::string& message) override {
      const std::lock_guard lock(mutex_);
      words_ += message + "\n";
    }
    std::string words() const {
      const std::lock_guard lock(mutex_);
      return words_;
    }

   private:
    mutable std::mutex mutex_;
    std::string words_;
  };

  Listener listener_;
  std::uint64_t resent_ = 0;
};

}  // namespace polarscan::test
