// SPDX-License-Identifier: Apache-2.0
#include "acquisition/session/session_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "acquisition/session/mapped_file.h"
#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// Goes through the segments of one session and says what it finds.
class SegmentScanner {
 public:
  SegmentScanner(Session& session, Verify verify, Progress& progress)
      : session_(session), verify_(verify == Verify::kPayloads), progress_(progress) {}

  void Run() {
    const std::vector<std::uint64_t> numbers = SegmentNumbers();
    session_.segments = numbers.empty() ? 0 : numbers.back() + 1;
    progress_.Begin("reading the session", Megabytes(numbers), "MB");
    for (const std::uint64_t number : numbers) ScanSegment(number, number == numbers.back());
    const std::uint64_t promised = session_.info.closed ? session_.info.records : 0;
    session_.unfinished = tail_;
    open_end_ = false;
    TellGaps();
    for (auto& [index, frame] : frames_) session_.frames.push_back(std::move(frame));
    if (next_index_ < promised)
      Damage(fmt::format("{} records at the end are missing", promised - next_index_));
  }

 private:
  static constexpr std::uint64_t kMega = 1'000'000;

  std::size_t Megabytes(const std::vector<std::uint64_t>& numbers) const {
    std::uint64_t bytes = 0;
    for (const std::uint64_t number : numbers) bytes += fs::file_size(SegmentPath(session_.folder, number));
    return std::size_t(bytes / kMega);
  }

  std::vector<std::uint64_t> SegmentNumbers() const {
    std::vector<std::uint64_t> numbers;
    if (!fs::is_directory(session_.folder / "segments")) return numbers;
    for (const auto& entry : fs::directory_iterator(session_.folder / "segments")) {
      const std::string name = entry.path().filename().string();
      const bool counts =
          name.size() == 10 && name.ends_with(".seg") && name.find_first_not_of("0123456789") == 6;
      if (counts) numbers.push_back(std::stoull(name));
    }
    std::ranges::sort(numbers);
    return numbers;
  }

  void ScanSegment(std::uint64_t number, bool last) {
    const MappedFile file(SegmentPath(session_.folder, number));
    const std::string_view bytes = file.bytes();
    open_end_ = last && !session_.info.closed;
    session_.last_segment_bytes = 0;
    std::uint64_t at = 0;
    while (at < bytes.size()) {
      progress_.Check();
      const std::optional<Record> record = WholeRecord(bytes.substr(at));
      if (!record) {
        const std::uint64_t next = NextRecord(bytes, at + 1);
        Damage(fmt::format("{} bytes at offset {} of segment {:06} cannot be read", next - at, at, number));
        if (next == bytes.size()) break;
        at = next;
        continue;
      }
      const bool good = Take(*record, number, at, bytes, verify_ || open_end_);
      const std::uint64_t end = at + kRecordHeaderBytes + record->payload_bytes;
      progress_.Advance(std::size_t((read_ + end) / kMega - (read_ + at) / kMega));
      at = end;
      if (good) EndOfWholeRecord(at);
    }
    read_ += bytes.size();
  }

  std::optional<Record> WholeRecord(std::string_view bytes) const {
    std::optional<Record> record = DecodeHeader(bytes);
    if (!record || record->session != session_.info.id) return std::nullopt;
    if (record->payload_bytes > bytes.size() - kRecordHeaderBytes) return std::nullopt;
    return record;
  }

  // The offset of the next whole record at or after `from`; the end if there is none.
  std::uint64_t NextRecord(std::string_view bytes, std::uint64_t from) const {
    while (true) {
      const std::size_t at = bytes.find(kRecordMagic, from);
      if (at == std::string_view::npos) return bytes.size();
      if (WholeRecord(bytes.substr(at))) return at;
      from = at + 1;
    }
  }

  // False if the payload is known to be damaged.
  bool Take(const Record& record, std::uint64_t segment, std::uint64_t at, std::string_view bytes,
            bool verify) {
    if (!seen_.emplace(record.index, Place{record.info.sequence, segment}).second) {
      Damage(fmt::format("frame {} is there twice: the second one is left out (segment {:06})",
                         record.info.sequence, segment));
      return false;
    }
    next_index_ = std::max(next_index_, record.index + 1);
    session_.records = next_index_;
    const std::uint64_t offset = at + kRecordHeaderBytes;
    const std::string_view payload = bytes.substr(offset, record.payload_bytes);
    if (verify && Hash(payload) != record.payload_hash) {
      Damage(fmt::format("frame {} is damaged, its checksum does not fit (segment {:06})",
                         record.info.sequence, segment));
      return false;
    }
    if (record.type == Record::Type::kMissing)
      session_.missing.push_back({record.info.sequence, record.missing, record.info.name});
    else
      frames_.emplace(record.index,
                      StoredFrame{record.info, segment, offset, record.payload_bytes, record.payload_hash});
    return true;
  }

  // Records are numbered without gaps; segments that lie in another order lose nothing.
  void TellGaps() {
    std::uint64_t next = 0;
    for (const auto& [index, place] : seen_) {
      if (index > next)
        Damage(fmt::format("{} records before frame {} are missing (segment {:06})", index - next,
                           place.sequence, place.segment));
      next = index + 1;
    }
  }

  // What is bad before a whole record was stored once; what is bad behind the last one of a session that was
  // not closed may never have been acknowledged.
  void Damage(std::string text) { (open_end_ ? tail_ : session_.damage).push_back(std::move(text)); }

  void EndOfWholeRecord(std::uint64_t at) {
    session_.last_segment_bytes = at;
    session_.damage.insert(session_.damage.end(), tail_.begin(), tail_.end());
    tail_.clear();
  }

  Session& session_;
  bool verify_, open_end_ = false;
  Progress& progress_;
  std::uint64_t read_ = 0;  // bytes of the segments before
  std::vector<std::string> tail_;
  struct Place {
    std::uint64_t sequence = 0, segment = 0;
  };
  std::map<std::uint64_t, Place> seen_;          // by the records' numbers
  std::map<std::uint64_t, StoredFrame> frames_;  // whole ones
  std::uint64_t next_index_ = 0;
};

FrameCounts CountsOf(const Session& session) {
  FrameCounts counts;
  counts.stored = session.frames.size();
  for (const StoredFrame& frame : session.frames) counts.bytes += frame.bytes;
  for (const MissingFrames& missing : session.missing) {
    if (missing.count == 0) {
      ++counts.restarts;
      continue;
    }
    (missing.reason.starts_with("dropped") ? counts.dropped : counts.lost) += missing.count;
    counts.reasons[missing.reason] += missing.count;
  }
  counts.cancelled = session.info.closed ? session.info.counts.cancelled : 0;
  return counts;
}

}  // namespace

Session OpenSession(const fs::path& folder, Verify verify) {
  Progress silent;
  return OpenSession(folder, verify, silent);
}

Session OpenSession(const fs::path& folder, Verify verify, Progress& progress) {
  Session session;
  session.folder = folder;
  session.info = ReadSessionInfo(folder);
  SegmentScanner(session, verify, progress).Run();
  session.info.counts = CountsOf(session);
  return session;
}

Frame ReadFrame(const Session& session, std::size_t index) {
  const StoredFrame& stored = session.frames.at(index);
  const fs::path path = SegmentPath(session.folder, stored.segment);
  const MappedFile file(path);
  const std::string where = fmt::format("frame {} in {}", stored.info.sequence, path.string());
  if (stored.offset + stored.bytes > file.bytes().size()) throw Error("the frame is cut off", where);
  const std::string_view payload = file.bytes().substr(stored.offset, stored.bytes);
  if (Hash(payload) != stored.hash)
    throw Error("the frame is damaged, its checksum does not fit", where,
                "polarscan check tells what is left");
  return {stored.info, {payload.begin(), payload.end()}};
}

}  // namespace polarscan
