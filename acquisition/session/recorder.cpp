// SPDX-License-Identifier: Apache-2.0
#include "acquisition/session/recorder.h"

#include <utility>

#include "core/error.h"

namespace polarscan {
namespace {

constexpr double kMega = 1e6;
constexpr std::size_t kLeastFrames = 2, kSpareBuffers = 4;
const std::string kNeverCame = "lost: never came", kBufferFull = "dropped: buffer full",
                  kDiskFailed = "dropped: disk failed";

}  // namespace

Recorder::Recorder(const std::filesystem::path& folder, SessionInfo info, const RecorderOptions& options)
    : writer_(folder, std::move(info), std::uint64_t(options.segment_mb * kMega), options.make_file),
      options_(options),
      thread_([this] { Drain(); }) {}

Recorder::~Recorder() {
  try {
    Close();
  } catch (const std::exception&) {  // who wants to know calls Close
  }
}

bool Recorder::Offer(Frame& frame) {
  const std::lock_guard lock(mutex_);
  Expect(frame.info.sequence);
  if (failure_ || !HasRoom(frame.payload.size())) {
    CountMissing({frame.info.sequence, 1, failure_ ? kDiskFailed : kBufferFull});
    return false;
  }
  ++counts_.pending;
  queued_bytes_ += frame.payload.size();
  ++queued_frames_;
  Item item{Frame{frame.info, std::move(frame.payload)}, {}};
  frame.payload.clear();
  if (!spare_.empty()) frame.payload = std::move(spare_.back()), spare_.pop_back();
  queue_.push_back(std::move(item));
  work_.notify_one();
  return true;
}

void Recorder::Lost(std::uint64_t sequence, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  if (last_sequence_ && sequence <= *last_sequence_) return;  // the gap that it left is counted already
  Expect(sequence);
  CountMissing({sequence, 1, "lost: " + reason});
}

void Recorder::Restarted(std::uint64_t sequence, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  if (sequence > 0) last_sequence_ = sequence - 1;
  ++counts_.restarts;
  queue_.push_back({std::nullopt, {sequence, 0, "restart: " + reason, true}});
  work_.notify_one();
}

void Recorder::Skip(std::uint64_t sequence) {
  const std::lock_guard lock(mutex_);
  Expect(sequence);
  ++counts_.cancelled;
}

// Counts the frames between the last one and this one. A camera that starts counting again has lost nothing.
void Recorder::Expect(std::uint64_t sequence) {
  if (last_sequence_ && sequence > *last_sequence_ + 1)
    CountMissing({*last_sequence_ + 1, sequence - *last_sequence_ - 1, kNeverCame});
  last_sequence_ = sequence;
}

// A run of missing frames is one note in the session.
void Recorder::CountMissing(const Missing& missing) {
  (missing.reason.starts_with("dropped") ? counts_.dropped : counts_.lost) += missing.count;
  counts_.reasons[missing.reason] += missing.count;
  if (!queue_.empty()) {
    Missing& last = queue_.back().missing;
    const bool continues = !queue_.back().frame && last.reason == missing.reason;
    if (continues && last.first + last.count == missing.first) {
      last.count += missing.count;
      return;
    }
  }
  queue_.push_back({std::nullopt, missing});
  work_.notify_one();
}

bool Recorder::HasRoom(std::size_t bytes) const {
  return queued_frames_ < kLeastFrames || double(queued_bytes_ + bytes) <= options_.buffer_mb * kMega;
}

FrameCounts Recorder::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

bool Recorder::failed() const {
  const std::lock_guard lock(mutex_);
  return failure_ != nullptr;
}

// The writer's thread.
void Recorder::Drain() {
  std::unique_lock lock(mutex_);
  try {
    while (true) {
      work_.wait_for(lock, std::chrono::duration<double>(options_.sync_s),
                     [&] { return stop_ || !queue_.empty(); });
      if (queue_.empty()) {
        lock.unlock();
        SyncIfDue(true);
        lock.lock();
        if (stop_ && queue_.empty()) return;
        continue;
      }
      Item item = std::move(queue_.front());
      queue_.pop_front();
      lock.unlock();
      WriteItem(item);
      SyncIfDue(false);
      lock.lock();
    }
  } catch (...) {
    if (lock.owns_lock()) lock.unlock();
    Fail(std::current_exception());
  }
}

void Recorder::WriteItem(Item& item) {
  if (item.missing.restart) writer_.NewSegment();
  if (!item.frame) return writer_.AppendMissing(item.missing.first, item.missing.count, item.missing.reason);
  writer_.Append(*item.frame);
  const std::size_t bytes = item.frame->payload.size();
  ++unsynced_frames_;
  unsynced_bytes_ += bytes;
  const std::lock_guard lock(mutex_);
  queued_bytes_ -= bytes;
  --queued_frames_;
  if (spare_.size() < kSpareBuffers) spare_.push_back(std::move(item.frame->payload));
}

// Only what was synced counts as stored.
void Recorder::SyncIfDue(bool now) {
  if (!now && std::chrono::duration<double>(Clock::now() - synced_).count() < options_.sync_s) return;
  if (unsynced_frames_ > 0) writer_.Sync();
  synced_ = Clock::now();
  const std::lock_guard lock(mutex_);
  counts_.stored += unsynced_frames_;
  counts_.pending -= unsynced_frames_;
  counts_.bytes += unsynced_bytes_;
  unsynced_frames_ = unsynced_bytes_ = 0;
}

// What was written before counts, if it can still be synced; what was on its way to the disk does not arrive.
void Recorder::Fail(std::exception_ptr failure) {
  try {
    SyncIfDue(true);
  } catch (const Error&) {  // the first failure is the one to tell
  }
  const std::lock_guard lock(mutex_);
  failure_ = failure;
  counts_.dropped += counts_.pending;
  counts_.reasons[kDiskFailed] += counts_.pending;
  counts_.pending = 0;
  queue_.clear();
}

void Recorder::Close() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  work_.notify_one();
  thread_.join();
  if (failure_) std::rethrow_exception(failure_);
  writer_.Close(counts_);
}

}  // namespace polarscan
