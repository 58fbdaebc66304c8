// SPDX-License-Identifier: Apache-2.0
#include "acquisition/session/session.h"

#include <fmt/format.h>

#include <charconv>

#include "core/error.h"
#include "core/files/files.h"
#include "core/words.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kFormat = "polarscan session";
constexpr int kSessionVersion = 1;

FrameCounts CountsFrom(const json& value) {
  FrameCounts counts;
  const auto number = [&](const char* key) { return WholeNumber{value.at(key)}; };
  counts.stored = number("stored"), counts.lost = number("lost"), counts.dropped = number("dropped");
  counts.cancelled = number("cancelled"), counts.bytes = number("bytes");
  counts.restarts = number("restarts");
  for (const auto& [reason, count] : value.at("reasons").items()) counts.reasons[reason] = WholeNumber{count};
  return counts;
}

std::uint64_t IdFrom(const std::string& hex) {
  std::uint64_t id = 0;
  std::from_chars(hex.data(), hex.data() + hex.size(), id, 16);
  return id;
}

SessionInfo InfoFrom(const json& value) {
  SessionInfo info;
  info.id = IdFrom(value.at("id"));
  info.closed = value.at("state") == "closed";
  info.created = value.at("created").get<std::string>();
  info.camera = value.at("camera"), info.sensor = value.at("sensor"), info.settings = value.at("settings");
  info.counts = CountsFrom(value.at("counts"));
  info.records = WholeNumber{value.at("records")}, info.segments = WholeNumber{value.at("segments")};
  return info;
}

}  // namespace

json ToJson(const FrameCounts& counts) {
  return {{"stored", counts.stored},       {"lost", counts.lost},         {"dropped", counts.dropped},
          {"cancelled", counts.cancelled}, {"restarts", counts.restarts}, {"bytes", counts.bytes},
          {"reasons", counts.reasons}};
}

std::string Describe(const FrameCounts& counts) {
  std::string reasons;
  for (const auto& [reason, count] : counts.reasons)
    reasons += fmt::format("{}{} {}", reasons.empty() ? "" : ", ", count, reason);
  if (counts.restarts > 0)
    reasons += fmt::format("{}{} restarts of the camera", reasons.empty() ? "" : ", ", counts.restarts);
  return fmt::format("{} stored, {} lost, {} dropped{}", counts.stored, counts.lost, counts.dropped,
                     reasons.empty() ? "" : " (" + reasons + ")");
}

bool IsSession(const fs::path& folder) { return fs::exists(folder / "session.json"); }

SessionInfo ReadSessionInfo(const fs::path& folder) {
  const fs::path path = folder / "session.json";
  if (!fs::exists(path)) throw Error("this folder is not a session, it has no session.json", folder.string());
  const json value = ReadJson(path);
  try {
    if (value.at("format") != kFormat) throw Error("this is not a session of polarscan", path.string());
    if (value.at("version") != kSessionVersion)
      throw Error("a newer polarscan has written this session", path.string(), "Use that one");
    return InfoFrom(value);
  } catch (const json::exception& e) {
    throw Error(fmt::format("session.json is damaged ({})", JsonReason(e.what())), path.string());
  }
}

void WriteSessionInfo(const fs::path& folder, const SessionInfo& info) {
  WriteJson(folder / "session.json", {{"format", kFormat},
                                      {"version", kSessionVersion},
                                      {"id", ToHex(info.id)},
                                      {"state", info.closed ? "closed" : "recording"},
                                      {"created", info.created},
                                      {"camera", info.camera},
                                      {"sensor", info.sensor},
                                      {"settings", info.settings},
                                      {"counts", ToJson(info.counts)},
                                      {"records", info.records},
                                      {"segments", info.segments}});
}

fs::path SegmentPath(const fs::path& folder, std::uint64_t number) {
  return folder / "segments" / fmt::format("{:06}.seg", number);
}

}  // namespace polarscan
