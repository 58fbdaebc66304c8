// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

namespace polarscan {

// What became of the frames that a camera took: each is counted once.
struct FrameCounts {
  std::uint64_t stored = 0;     // in the session and synced
  std::uint64_t pending = 0;    // received, on the way to the disk; 0 when a session is closed
  std::uint64_t lost = 0;       // in transport: never came, or came incomplete
  std::uint64_t dropped = 0;    // by us: no room in the buffer, or the disk failed
  std::uint64_t cancelled = 0;  // came while none was asked for
  std::uint64_t restarts = 0;   // of the camera, while frames were not counted
  std::uint64_t bytes = 0;      // of payload, of the stored ones
  std::map<std::string, std::uint64_t> reasons = {};  // of lost and dropped frames

  std::uint64_t total() const { return stored + pending + lost + dropped + cancelled; }
};
nlohmann::json ToJson(const FrameCounts& counts);
// "120 stored, 2 lost (never came), 0 dropped"
std::string Describe(const FrameCounts& counts);

// session.json: what holds for the whole session. It is replaced atomically, when the session begins and
// ends.
struct SessionInfo {
  std::uint64_t id = 0;
  bool closed = false;    // ended in order; counts and records are then those of all segments
  std::string created;    // UTC, "2026-11-22T18:10:00Z"
  nlohmann::json camera;  // {"id", "vendor", "model", "serial"}
  nlohmann::json sensor;  // as in set.json (docs/input.md): "layout", "bits", "black_dn", ...
  nlohmann::json settings = nlohmann::json::object();  // the camera's features when recording began
  FrameCounts counts;
  std::uint64_t records = 0, segments = 0;
};

bool IsSession(const std::filesystem::path& folder);
// Throws Error if session.json is missing, damaged or of a newer program.
SessionInfo ReadSessionInfo(const std::filesystem::path& folder);
void WriteSessionInfo(const std::filesystem::path& folder, const SessionInfo& info);

// FOLDER/segments/000000.seg, ...
std::filesystem::path SegmentPath(const std::filesystem::path& folder, std::uint64_t number);

}  // namespace polarscan
