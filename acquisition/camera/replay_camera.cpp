// SPDX-License-Identifier: Apache-2.0
#include "acquisition/camera/replay_camera.h"

#include <cstdlib>

#include "acquisition/camera/pacer.h"
#include "acquisition/session/session_reader.h"
#include "core/error.h"

namespace polarscan {
namespace {

class ReplayCamera : public Camera {
 public:
  explicit ReplayCamera(const std::filesystem::path& folder) : session_(OpenSession(folder)) {
    if (session_.frames.empty()) throw Error("there are no frames in this session", folder.string());
  }

  CameraInfo info() const override {
    const auto text = [&](const char* key) { return session_.info.camera.value(key, ""); };
    return {"replay:" + session_.folder.string(), text("vendor"), text("model"), text("serial")};
  }
  nlohmann::json sensor() const override { return session_.info.sensor; }
  nlohmann::json features() const override {
    nlohmann::json values = session_.info.settings;
    values["speed"] = speed_;
    return values;
  }

  void Set(const std::string& feature, const std::string& value) override {
    char* end = nullptr;
    const double speed = std::strtod(value.c_str(), &end);
    if (feature != "speed")
      throw Error("a recording has no such feature to set", feature, "It has speed (2: twice as fast)");
    if (value.empty() || *end || !(speed >= 0 && speed <= 1e6))
      throw Error("the speed of a replay is a number from 0 to 1000000", value);
    speed_ = speed;
  }

  void Start(Progress&) override {
    next_ = 0;
    pacer_.Start();
  }

  Delivery Next(Frame& frame, std::chrono::milliseconds timeout) override {
    if (next_ == session_.frames.size()) return Delivery::kEnded;
    if (!pacer_.WaitUntil(DueAt(), timeout)) return Delivery::kNothing;
    try {
      frame = ReadFrame(session_, next_++);
    } catch (const Error&) {
      frame.info = session_.frames[next_ - 1].info;
      frame.info.name = "damaged in the recording";
      return Delivery::kDamaged;
    }
    return Delivery::kFrame;
  }

  void Stop() override {}

 private:
  double DueAt() const {
    if (speed_ == 0) return 0;
    const std::int64_t begin = session_.frames[0].info.host_time_ns;
    return double(session_.frames[next_].info.host_time_ns - begin) * 1e-9 / speed_;
  }

  Session session_;
  double speed_ = 1;
  std::size_t next_ = 0;
  Pacer pacer_;
};

}  // namespace

std::unique_ptr<Camera> OpenReplayCamera(const std::filesystem::path& session) {
  return std::make_unique<ReplayCamera>(session);
}

}  // namespace polarscan
