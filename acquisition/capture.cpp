// SPDX-License-Identifier: Apache-2.0
#include "acquisition/capture.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "core/error.h"

namespace polarscan {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kWait = std::chrono::milliseconds(100), kStatusEvery = std::chrono::milliseconds(200);
constexpr auto kTriggerPatience = std::chrono::seconds(5);
constexpr auto kKeyEvery = std::chrono::milliseconds(20), kLookEvery = std::chrono::milliseconds(500);

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// The receiving thread: takes frames off the camera as fast as they come and hands those that belong to a
// shot on.
class Receiver {
 public:
  Receiver(Camera& camera, Recorder& recorder, const CaptureOptions& options, Progress& progress)
      : camera_(camera), recorder_(recorder), options_(options), progress_(progress), thread_([this] {
          Run();
        }) {}
  ~Receiver() { Stop(); }

  void AskForShot() { ++asked_; }
  bool ended() const { return ended_; }
  // When the camera last said anything.
  Clock::time_point heard() const { return heard_; }
  std::uint64_t shots() const { return shots_; }

  // The next frame is kept for Latest.
  void AskForLook() { wants_look_ = true; }
  // Nothing if none came since it was asked for.
  std::optional<Frame> Latest() {
    const std::lock_guard lock(mutex_);
    return std::exchange(latest_, std::nullopt);
  }

  // Throws what the camera threw.
  void Finish() {
    Stop();
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void Stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }

  void Run() {
    try {
      while (!stop_ && !recorder_.failed() && !Enough()) {
        if (options_.trigger) AskForFrame();
        Receive(camera_.Next(frame_, kWait));
      }
    } catch (...) {
      failure_ = std::current_exception();
    }
    ended_ = true;
  }

  // One frame at a time; again where none came.
  void AskForFrame() {
    const bool wanted = options_.streams() || left_in_shot_ > 0 || asked_ > 0;
    const bool waits = triggered_ && Clock::now() - *triggered_ < kTriggerPatience;
    if (!wanted || waits) return;
    if (triggered_) progress_.Warn("no frame came after a trigger; asking again");
    camera_.Trigger();
    triggered_ = Clock::now();
  }

  bool Enough() const { return options_.frames > 0 && taken_ >= std::uint64_t(options_.frames); }

  void Receive(Delivery delivery) {
    if (delivery != Delivery::kNothing) {
      heard_ = Clock::now();
      triggered_.reset();
    }
    if (delivery == Delivery::kEnded) stop_ = true;
    if (delivery == Delivery::kDamaged) recorder_.Lost(frame_.info.sequence, frame_.info.name);
    if (delivery == Delivery::kRestarted) {
      recorder_.Restarted(frame_.info.sequence, frame_.info.name);
      before_.reset();
    }
    if (delivery != Delivery::kFrame) return;
    WatchClock();
    if (wants_look_.exchange(false)) {
      const std::lock_guard lock(mutex_);
      latest_ = frame_;
    }
    const std::optional<std::uint64_t> shot = options_.streams() ? ShotInStream() : ShotAskedFor();
    if (!shot) return recorder_.Skip(frame_.info.sequence);
    frame_.info.shot = *shot;
    recorder_.Offer(frame_);
    ++taken_;
  }

  void WatchClock() {
    const double jump = before_ ? ClockJump(*before_, frame_.info) : 0;
    if (std::abs(jump) > kClockJump_s)
      progress_.Warn(
          fmt::format("the camera's clock jumped by {:.1f} s at frame {}", jump, frame_.info.sequence));
    before_ = frame_.info;
  }

  // By the frame's number, so that a lost frame does not shift those behind it into other shots.
  std::uint64_t ShotInStream() {
    const std::uint64_t shot = frame_.info.sequence / std::uint64_t(options_.shot_frames);
    if (std::exchange(last_shot_, shot) != shot) ++shots_;
    return shot;
  }

  // The shot that the frame that just came belongs to; begins one where one was asked for.
  std::optional<std::uint64_t> ShotAskedFor() {
    if (left_in_shot_ == 0) {
      if (asked_ == 0) return std::nullopt;
      --asked_;
      left_in_shot_ = options_.shot_frames;
    }
    const std::uint64_t shot = shots_;
    if (--left_in_shot_ == 0) ++shots_;
    return shot;
  }

  Camera& camera_;
  Recorder& recorder_;
  const CaptureOptions options_;
  Progress& progress_;
  Frame frame_;
  std::optional<FrameInfo> before_;  // of the last frame
  std::uint64_t taken_ = 0;
  std::optional<Clock::time_point> triggered_;  // when the frame that is still to come was asked for
  int left_in_shot_ = 0;
  std::optional<std::uint64_t> last_shot_;
  std::atomic<int> asked_ = 0;
  std::atomic<std::uint64_t> shots_ = 0;
  std::atomic<Clock::time_point> heard_ = Clock::now();
  std::atomic<bool> stop_ = false, ended_ = false, wants_look_ = false;
  std::mutex mutex_;  // of the next
  std::optional<Frame> latest_;
  std::exception_ptr failure_;
  std::thread thread_;
};

// Says when nothing comes for long; a camera that is slow by nature is soon given more time.
class SilenceWatch {
 public:
  void Look(Clock::time_point heard, Progress& progress) {
    const double seconds = SecondsSince(heard);
    if (!silent_ && seconds > patience_s_) {
      progress.Warn(fmt::format(
          "no frame for {:.0f} s: does the camera wait for a trigger, or is it cut off?", seconds));
      silent_ = true;
    } else if (silent_ && seconds < patience_s_) {
      progress.Info("frames come again");
      patience_s_ = 2 * longest_s_;
      silent_ = false;
    }
    longest_s_ = std::max(longest_s_, seconds);
  }

 private:
  double patience_s_ = 3, longest_s_ = 0;
  bool silent_ = false;
};

// The calling thread: asks for shots in time and on keys, and looks after the end.
void Watch(Receiver& receiver, const Recorder& recorder, const CaptureOptions& options,
           const nlohmann::json& sensor, const CaptureHooks& hooks, Progress& progress) {
  SilenceWatch silence;
  const Clock::time_point begin = Clock::now();
  Clock::time_point shown, looked;
  double next_shot_s = 0;
  while (!receiver.ended() && !progress.cancelled()) {
    const double seconds = SecondsSince(begin);
    if (options.seconds > 0 && seconds >= options.seconds) return;
    if (options.every_s > 0 && seconds >= next_shot_s) {
      receiver.AskForShot();
      next_shot_s += options.every_s;
    }
    const CaptureHooks::Key key = hooks.key();
    if (key == CaptureHooks::Key::kQuit) return;
    if (key == CaptureHooks::Key::kShot) receiver.AskForShot();
    if (!options.trigger) silence.Look(receiver.heard(), progress);
    if (Clock::now() - shown >= kStatusEvery) {
      hooks.status({recorder.counts(), seconds, receiver.shots()});
      shown = Clock::now();
    }
    if (hooks.look && Clock::now() - looked >= kLookEvery) {
      receiver.AskForLook();
      looked = Clock::now();
    }
    if (hooks.look)
      if (const std::optional<Frame> frame = receiver.Latest()) hooks.look(*frame, sensor);
    std::this_thread::sleep_for(kKeyEvery);
  }
}

SessionInfo Describe(const Camera& camera, const nlohmann::json& sensor) {
  SessionInfo info = NewSessionInfo();
  info.camera = ToJson(camera.info());
  info.settings = camera.features();
  info.sensor = camera.sensor();
  info.sensor.update(sensor);
  return info;
}

void CloseRecorder(Recorder& recorder, const std::filesystem::path& folder) {
  try {
    recorder.Close();
  } catch (const Error& error) {
    throw Error(fmt::format("recording ended early, {}", error.what()), folder.string(),
                fmt::format("The {} frames stored before are safe", recorder.counts().stored));
  }
}

}  // namespace

OptionTable Table(CaptureOptions& o) {
  return {
      {"frames", &o.frames, "end after this many frames; 0: go on", "frame", 0, 2e9},
      {"seconds", &o.seconds, "end after this time; 0: go on", "s", 0, 1e9},
      {"every", &o.every_s, "one shot in this time; 0: every frame", "s", 0, 1e6},
      {"on-key", &o.on_key, "one shot at each press of the space bar, q ends (a turntable)"},
      {"trigger", &o.trigger, "by software trigger: the camera takes frames only when they are wanted"},
      {"shot-frames", &o.shot_frames, "frames of a shot; a view is their median, pixel by pixel", "frame", 1,
       1000},
      {"buffer", &o.buffer_mb, "frames between camera and disk; full: frames are dropped and counted", "MB",
       1, 1e6},
      {"segment", &o.segment_mb, "size of a session's segments", "MB", 1, 1e6},
      {"sync", &o.sync_s, "at most this much is lost in a power cut", "s", 0.01, 60},
  };
}

CaptureStatus Capture(Camera& camera, const std::filesystem::path& folder, const nlohmann::json& sensor,
                      const CaptureOptions& options, const CaptureHooks& hooks, Progress& progress) {
  RequireNewSessionFolder(folder);
  const RecorderOptions recording{options.buffer_mb, options.segment_mb, options.sync_s, CreateAppendFile};
  if (options.trigger) camera.UseSoftwareTrigger();
  camera.Start(progress);
  const Clock::time_point begin = Clock::now();
  const SessionInfo info = Describe(camera, sensor);
  Recorder recorder(folder, info, recording);
  Receiver receiver(camera, recorder, options, progress);
  Watch(receiver, recorder, options, info.sensor, hooks, progress);
  receiver.Finish();
  camera.Stop();
  CloseRecorder(recorder, folder);
  const CaptureStatus status{recorder.counts(), SecondsSince(begin), receiver.shots()};
  hooks.status(status);
  return status;
}

}  // namespace polarscan
