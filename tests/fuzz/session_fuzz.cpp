// SPDX-License-Identifier: Apache-2.0
// Sessions of whole, foreign and damaged records with anything between them: the reader finds every frame
// that stands there whole, invents none, and repairing loses none.
#include <fuzzer/FuzzedDataProvider.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "acquisition/session/session_reader.h"
#include "acquisition/session/session_repair.h"
#include "acquisition/session/session_views.h"
#include "core/error.h"
#include "core/files/files.h"

using namespace polarscan;
namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kId = 0x1234;
using Payloads = std::multiset<std::string>;

const fs::path& Folder() {
  static const fs::path folder = [] {
    const fs::path memory = "/dev/shm";
    return (fs::exists(memory) ? memory : fs::temp_directory_path()) /
           ("polarscan-fuzz-" + std::to_string(getpid()));
  }();
  return folder;
}

Record AnyRecord(FuzzedDataProvider& in, const std::string& payload) {
  Record record;
  record.type = in.ConsumeIntegralInRange(0, 5) == 0 ? Record::Type::kMissing : Record::Type::kFrame;
  record.session = in.ConsumeIntegralInRange(0, 7) == 0 ? kId + 1 : kId;
  record.index = in.ConsumeBool() ? in.ConsumeIntegral<std::uint64_t>() : in.ConsumeIntegralInRange(0, 9);
  record.info.sequence = in.ConsumeIntegral<std::uint64_t>();
  record.info.width = in.ConsumeIntegralInRange(-1, 40);
  record.info.height = in.ConsumeIntegralInRange(-1, 40);
  record.info.stride = in.ConsumeBool() ? 0 : in.ConsumeIntegral<int>();
  record.info.shot = in.ConsumeIntegralInRange(0, 3);
  record.info.pixel_format = in.ConsumeBool() ? "Mono12p" : in.ConsumeRandomLengthString(47);
  record.info.name = in.ConsumeRandomLengthString(20);
  record.missing = in.ConsumeIntegral<std::uint64_t>();
  record.payload_bytes =
      in.ConsumeIntegralInRange(0, 9) == 0 ? in.ConsumeIntegral<std::uint64_t>() : payload.size();
  record.payload_hash = Hash(payload);
  return record;
}

// A segment's bytes. Payloads of frames that stand in it go to `written`.
std::string AnySegment(FuzzedDataProvider& in, Payloads& written) {
  std::string bytes;
  while (in.remaining_bytes() > 0 && in.ConsumeIntegralInRange(0, 7) != 0) {
    const std::string text = in.ConsumeRandomLengthString(300);
    if (in.ConsumeIntegralInRange(0, 3) == 0) {
      bytes += text;
    } else {
      bytes += EncodeHeader(AnyRecord(in, text)) + text;
      written.insert(text);
    }
  }
  if (in.ConsumeBool() && !bytes.empty())
    bytes.resize(in.ConsumeIntegralInRange<std::size_t>(0, bytes.size()));
  return bytes;
}

void Write(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

void CheckFrames(const Session& session, Payloads written) {
  for (std::size_t i = 0; i < session.frames.size(); ++i) {
    try {
      const Frame frame = ReadFrame(session, i);
      const auto found = written.find(std::string(frame.payload.begin(), frame.payload.end()));
      if (found == written.end()) std::abort();  // invented
      written.erase(found);
      Counts(frame);
    } catch (const Error&) {
    }
  }
  for (const SessionView& view : ViewsOf(session)) {
    try {
      MedianCounts(session, view);
    } catch (const Error&) {
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider in(data, size);
  fs::remove_all(Folder());
  fs::create_directories(Folder() / "segments");
  SessionInfo info;
  info.id = kId;
  info.closed = in.ConsumeBool();
  info.segments = in.ConsumeIntegralInRange(0, 4);
  info.records = in.ConsumeIntegralInRange(0, 12);
  info.camera = info.sensor = nlohmann::json::object();
  WriteSessionInfo(Folder(), info);
  if (in.ConsumeIntegralInRange(0, 5) == 0)
    Write(Folder() / "session.json", in.ConsumeRandomLengthString(500));
  Payloads written;
  const int segments = in.ConsumeIntegralInRange(0, 3);
  for (int i = 0; i < segments; ++i) Write(SegmentPath(Folder(), std::uint64_t(i)), AnySegment(in, written));
  try {
    Session session = OpenSession(Folder(), in.ConsumeBool() ? Verify::kPayloads : Verify::kHeaders);
    CheckFrames(session, written);
    const std::size_t frames = OpenSession(Folder(), Verify::kPayloads).frames.size();
    RepairSession(session);
    if (OpenSession(Folder(), Verify::kPayloads).frames.size() != frames) std::abort();  // lost by the repair
  } catch (const Error&) {
  }
  return 0;
}
