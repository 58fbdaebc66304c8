// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "acquisition/session/record.h"
#include "acquisition/session/session.h"
#include "core/progress.h"

namespace polarscan {

// Where a frame lies.
struct StoredFrame {
  FrameInfo info;
  std::uint64_t segment = 0, offset = 0;  // of the payload in its segment
  std::uint64_t bytes = 0, hash = 0;      // of the payload
};

// Frames that are known to be missing, and why.
struct MissingFrames {
  std::uint64_t first = 0, count = 0;
  std::string reason;
};

// A session as it is on the disk, after whatever happened to it. Made by going through all segments; no count
// in any file is trusted.
struct Session {
  std::filesystem::path folder;
  SessionInfo info;
  std::vector<StoredFrame> frames;     // whole ones, in the order of recording
  std::vector<MissingFrames> missing;  // by the recorder's own word
  std::vector<std::string>
      unfinished;  // not damage: what a kill or a power cut left of frames not yet acknowledged
  std::vector<std::string> damage;          // one sentence each: what was stored once and cannot be read now
  std::uint64_t last_segment_bytes = 0;     // of whole records at the start of the last segment
  std::uint64_t segments = 0, records = 0;  // by the highest number seen of each
};

// kPayloads: also reads every payload and compares checksums; kHeaders does so only for the last segment of a
// session that was not closed.
enum class Verify { kHeaders, kPayloads };

// Throws Error only if session.json cannot be used or a file cannot be opened; damage to segments is
// described, and all frames around it are found.
Session OpenSession(const std::filesystem::path& folder, Verify verify = Verify::kHeaders);
// The same with progress, one unit a megabyte. Throws Cancelled, too.
Session OpenSession(const std::filesystem::path& folder, Verify verify, Progress& progress);

// One frame's payload, checksum compared. Throws Error with frame and file if it is damaged.
Frame ReadFrame(const Session& session, std::size_t frame);

}  // namespace polarscan
