// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/session/record.h"
#include "acquisition/session/session.h"
#include "core/files/append_file.h"

namespace polarscan {

// Appends records to a new session: one thread, no buffering of its own. Makes the folder and session.json;
// begins a new segment when the current one has grown to `segment_bytes`. Every call throws Error with path
// and reason; after a failed Append the segment is cut back to whole records where the disk lets us.
class SessionWriter {
 public:
  // Throws Error if the folder holds anything already.
  SessionWriter(const std::filesystem::path& folder, SessionInfo info, std::uint64_t segment_bytes,
                AppendFileMaker make_file = CreateAppendFile);

  void Append(const Frame& frame);
  // Frames that are not there, and why ("lost: ..." or "dropped: ...").
  void AppendMissing(std::uint64_t first, std::uint64_t count, const std::string& reason);
  // The next record begins a new segment.
  void NewSegment();
  // What was appended before survives a power cut after it. One that failed is not asked again: the system
  // may then say yes though the bytes are gone.
  void Sync();
  // Syncs and writes the final session.json with these counts.
  void Close(const FrameCounts& counts);

 private:
  void Write(Record record, std::string_view payload);
  void BeginSegment();

  std::filesystem::path folder_;
  SessionInfo info_;
  std::uint64_t segment_bytes_, written_ = 0;  // of the current segment
  AppendFileMaker make_file_;
  std::unique_ptr<AppendFile> file_;
  bool sync_failed_ = false, new_segment_ = false;
};

// Throws Error unless the folder is empty, or not there and can be made.
void RequireNewSessionFolder(const std::filesystem::path& folder);

// What a new session.json starts with: a new id and the time.
SessionInfo NewSessionInfo();

}  // namespace polarscan
