// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>

#include "acquisition/camera/camera.h"
#include "acquisition/session/recorder.h"
#include "core/options.h"

namespace polarscan {

// What to record, and when to end. A shot is `shot_frames` frames in a row that become one view; where every
// frame is wanted, shot n is the frames from number n * shot_frames on.
struct CaptureOptions {
  int frames = 0;      // 0: no end
  double seconds = 0;  // 0: no end
  double every_s = 0;  // 0: all frames
  bool on_key = false;
  bool trigger = false;  // the camera takes frames only when they are wanted
  int shot_frames = 1;
  double buffer_mb = 512, segment_mb = 2048, sync_s = 0.5;

  bool streams() const { return every_s <= 0 && !on_key; }  // every frame is wanted
};
OptionTable Table(CaptureOptions& options);

struct CaptureStatus {
  FrameCounts counts;
  double seconds = 0;  // since the first frame could come
  std::uint64_t shots = 0;
};

// What the program adds: a line on the screen, a keyboard, a look at the pictures. All are called on the
// thread that called Capture.
struct CaptureHooks {
  enum class Key { kNone, kShot, kQuit };
  std::function<void(const CaptureStatus&)> status = [](const CaptureStatus&) {
  };  // about five times a second
  std::function<Key()> key = [] { return Key::kNone; };
  // The latest frame, about twice a second, whether it is stored or not, and the session's "sensor", which
  // the camera may tell only once it has begun; empty: nobody looks.
  std::function<void(const Frame&, const nlohmann::json& sensor)> look = {};
};

// Records into a new session until the options, the camera, a key or Progress::Cancel end it; all of these
// end it cleanly, with everything received stored. `sensor` goes on top of what the camera says about itself.
// Throws Error if the folder is not empty, the camera fails or the disk does (the session then holds what was
// stored before).
CaptureStatus Capture(Camera& camera, const std::filesystem::path& folder, const nlohmann::json& sensor,
                      const CaptureOptions& options, const CaptureHooks& hooks, Progress& progress);

}  // namespace polarscan
