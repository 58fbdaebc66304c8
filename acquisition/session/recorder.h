// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "acquisition/session/session_writer.h"

namespace polarscan {

struct RecorderOptions {
  double buffer_mb = 512;    // of frames between camera and disk; at least two frames
  double segment_mb = 2048;  // a segment ends after this
  double sync_s = 0.5;       // a frame is acknowledged at most about this much later
  AppendFileMaker make_file = CreateAppendFile;
};

// Takes frames from a camera's thread and writes them on a thread of its own. The caller is never blocked by
// the disk: where the buffer is full a frame is dropped, counted and noted in the session. Frames that never
// came show as gaps of the sequence. Offer, Lost and Skip belong to one thread; counts() to any.
class Recorder {
 public:
  Recorder(const std::filesystem::path& folder, SessionInfo info, const RecorderOptions& options);
  ~Recorder();  // as Close, without its Error

  // Takes the payload over and gives a used one back, so that memory is not asked for again and again. False
  // if the frame was dropped.
  bool Offer(Frame& frame);
  // The camera gave this frame up ("incomplete").
  void Lost(std::uint64_t sequence, const std::string& reason);
  // The camera was gone, and comes back with this frame: a note, and a new segment.
  void Restarted(std::uint64_t sequence, const std::string& reason);
  // The frame came, but nobody had asked for one.
  void Skip(std::uint64_t sequence);

  FrameCounts counts() const;
  // True once the disk has failed; Close throws what it said.
  bool failed() const;
  // Writes what is in the buffer, syncs, closes the session. Throws the Error that stopped the writer, if one
  // did.
  void Close();

 private:
  struct Missing {
    std::uint64_t first = 0, count = 0;
    std::string reason;
    bool restart = false;
  };
  struct Item {
    std::optional<Frame> frame;
    Missing missing;
  };
  using Clock = std::chrono::steady_clock;

  void Expect(std::uint64_t sequence);
  void CountMissing(const Missing& missing);
  bool HasRoom(std::size_t bytes) const;
  void Drain();
  void WriteItem(Item& item);
  void SyncIfDue(bool now);
  void Fail(std::exception_ptr failure);

  SessionWriter writer_;
  RecorderOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable work_;
  std::deque<Item> queue_;
  std::vector<std::vector<std::uint8_t>> spare_;
  FrameCounts counts_;
  std::size_t queued_bytes_ = 0, queued_frames_ = 0;
  std::optional<std::uint64_t> last_sequence_;
  std::exception_ptr failure_;
  bool stop_ = false;
  Clock::time_point synced_ = Clock::now();  // writer's thread only, as the next line
  std::uint64_t unsynced_frames_ = 0, unsynced_bytes_ = 0;
  std::thread thread_;
};

}  // namespace polarscan
