// SPDX-License-Identifier: Apache-2.0
// The recorder in front of slow, full and failing disks, and killed at any moment.
#include "acquisition/session/recorder.h"

#include <sys/mman.h>
#include <sys/wait.h>

#include <atomic>
#include <csignal>

#include "core/error.h"
#include "session_helpers.h"

namespace polarscan::test {
namespace {

using Clock = std::chrono::steady_clock;

// A disk that is slow, or is full after some bytes.
class BadDisk : public AppendFile {
 public:
  BadDisk(const std::filesystem::path& path, std::chrono::milliseconds delay, std::size_t room)
      : file_(CreateAppendFile(path)), path_(path), delay_(delay), room_(room) {}
  void Append(std::string_view head, std::string_view body) override {
    std::this_thread::sleep_for(delay_);
    if (head.size() + body.size() > room_) {
      file_->Append(head.substr(0, room_), {});  // a part arrives
      throw Error("cannot write the file (disk full)", path_.string());
    }
    room_ -= head.size() + body.size();
    file_->Append(head, body);
  }
  void Sync() override { file_->Sync(); }
  void Truncate(std::uint64_t bytes) override { file_->Truncate(bytes); }

 private:
  std::unique_ptr<AppendFile> file_;
  std::filesystem::path path_;
  std::chrono::milliseconds delay_;
  std::size_t room_;
};

RecorderOptions On(std::chrono::milliseconds delay, std::size_t room = 1 << 30) {
  RecorderOptions options;
  options.make_file = [=](const auto& path) { return std::make_unique<BadDisk>(path, delay, room); };
  return options;
}

TEST_F(SessionFolder, EveryFrameThatIsOfferedIsStoredAndGapsAreCountedAsLost) {
  Recorder recorder(session(), SomeInfo(), {});
  for (const std::uint64_t sequence : {5, 6, 9, 10}) {
    Frame frame = NumberedFrame(sequence);
    EXPECT_TRUE(recorder.Offer(frame));
  }
  recorder.Lost(11, "incomplete");
  recorder.Skip(12);
  recorder.Close();
  const Session read = OpenSession(session(), Verify::kPayloads);
  EXPECT_EQ(read.frames.size(), 4u);
  ExpectOnlyTrueFrames(read);
  ASSERT_EQ(read.missing.size(), 2u);
  EXPECT_EQ(read.missing[0].first, 7u);
  EXPECT_EQ(read.missing[0].count, 2u);
  EXPECT_EQ(read.missing[1].reason, "lost: incomplete");
  const FrameCounts counts = recorder.counts();
  EXPECT_EQ(counts.stored, 4u);
  EXPECT_EQ(counts.lost, 3u);
  EXPECT_EQ(counts.cancelled, 1u);
  EXPECT_EQ(counts.total(), 8u);  // 5 to 12
  EXPECT_EQ(read.info.counts.reasons, counts.reasons);
}

TEST_F(SessionFolder, AFrameThatIsGivenUpLateIsCountedOnce) {
  Recorder recorder(session(), SomeInfo(), {});
  for (const std::uint64_t sequence : {0, 1, 3, 4, 5}) {
    Frame frame = NumberedFrame(sequence);
    EXPECT_TRUE(recorder.Offer(frame));
    if (sequence == 4) recorder.Lost(2, "parts never came");
  }
  recorder.Close();
  EXPECT_EQ(recorder.counts().stored, 5u);
  EXPECT_EQ(recorder.counts().lost, 1u);
  EXPECT_EQ(recorder.counts().total(), 6u);
}

TEST_F(SessionFolder, ASlowDiskNeverBlocksTheCameraAndWhatDoesNotFitIsCounted) {
  RecorderOptions options = On(std::chrono::milliseconds(20));
  options.buffer_mb = 4 * 96e-6;  // four frames
  Recorder recorder(session(), SomeInfo(), options);
  std::uint64_t refused = 0;
  Clock::duration longest{};
  for (std::uint64_t i = 0; i < 200; ++i) {
    Frame frame = NumberedFrame(i);
    const auto begin = Clock::now();
    refused += !recorder.Offer(frame);
    longest = std::max(longest, Clock::now() - begin);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  recorder.Close();
  const FrameCounts counts = recorder.counts();
  EXPECT_GT(refused, 50u);
  EXPECT_EQ(counts.dropped, refused);
  EXPECT_EQ(counts.stored + counts.dropped, 200u);
  EXPECT_LT(longest, std::chrono::seconds(1)) << "200 writes take 4 s";
  const Session read = OpenSession(session(), Verify::kPayloads);
  EXPECT_EQ(read.frames.size(), counts.stored);
  std::uint64_t missing = 0;
  for (const MissingFrames& m : read.missing) missing += m.count;
  EXPECT_EQ(missing, refused) << "the session itself says what is missing";
  ExpectOnlyTrueFrames(read);
}

TEST_F(SessionFolder, AFullDiskEndsTheRecordingAndKeepsWhatWasStored) {
  Recorder recorder(session(), SomeInfo(), On({}, 5 * (kRecordHeaderBytes + 96) + 100));
  for (std::uint64_t i = 0; i < 20; ++i) {
    Frame frame = NumberedFrame(i);
    recorder.Offer(frame);
  }
  EXPECT_THROW(recorder.Close(), Error);
  const Session read = OpenSession(session(), Verify::kPayloads);
  EXPECT_EQ(read.frames.size(), 5u);
  EXPECT_TRUE(read.unfinished.empty()) << "the part of the sixth frame was cut off";
  EXPECT_TRUE(read.damage.empty());
  ExpectOnlyTrueFrames(read);
  EXPECT_EQ(recorder.counts().total(), 20u);
}

// A child records and tells through shared memory which frames are acknowledged; the parent kills it.
TEST_F(SessionFolder, KilledAtAnyMomentTheSessionHoldsEveryAcknowledgedFrame) {
  void* shared = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  auto* acknowledged = new (shared) std::atomic<std::uint64_t>;
  Random random(3);
  std::uint64_t most = 0;
  for (int round = 0; round < 200; ++round) {
    std::filesystem::remove_all(session());
    *acknowledged = 0;
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      RecorderOptions options;
      options.sync_s = 0.002;
      options.segment_mb = 0.01;
      Recorder recorder(session(), SomeInfo(), options);
      for (std::uint64_t i = 0;; ++i) {
        Frame frame = NumberedFrame(i);
        recorder.Offer(frame);
        *acknowledged = recorder.counts().stored;
        ::usleep(200);
      }
    }
    ::usleep(useconds_t(5000 + random.Below(60000)));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    if (!IsSession(session())) continue;  // killed before there was one
    const Session read = OpenSession(session(), Verify::kPayloads);
    ASSERT_GE(read.frames.size(), acknowledged->load());
    ASSERT_TRUE(read.damage.empty()) << read.damage[0];
    ASSERT_LE(read.unfinished.size(), 1u);
    for (std::size_t i = 0; i < read.frames.size(); ++i) ASSERT_EQ(read.frames[i].info.sequence, i);
    ExpectOnlyTrueFrames(read);
    most = std::max(most, acknowledged->load());
  }
  EXPECT_GT(most, 0u) << "no round got as far as acknowledging a frame";
  ::munmap(shared, 4096);
}

}  // namespace
}  // namespace polarscan::test
