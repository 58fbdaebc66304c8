// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "acquisition/session/session_reader.h"
#include "acquisition/session/session_writer.h"
#include "core/files/files.h"
#include "core/random.h"

namespace polarscan::test {

class SessionFolder : public testing::Test {
 protected:
  SessionFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "polarscan-session-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~SessionFolder() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path session() const { return folder_ / "session"; }
  std::filesystem::path segment(std::uint64_t number = 0) const { return SegmentPath(session(), number); }

  std::filesystem::path folder_;
};

// A frame whose payload follows from its number.
inline Frame NumberedFrame(std::uint64_t number, std::size_t bytes = 96) {
  Frame frame;
  frame.info.sequence = frame.info.shot = number;
  frame.info.pixel_format = "Mono8";
  frame.info.width = 12, frame.info.height = int(bytes / 12);
  frame.info.exposure_us = 1000.5;
  Random random(number, 1);
  for (std::size_t i = 0; i < bytes; ++i) frame.payload.push_back(std::uint8_t(random.Below(256)));
  return frame;
}

inline SessionInfo SomeInfo() {
  SessionInfo info = NewSessionInfo();
  info.camera = {{"id", "test"}};
  info.sensor = {{"layout", "90 45 / 135 0"}};
  return info;
}

// A session of frames 0 .. count-1; closed or left as a killed program leaves it.
inline void WriteSession(const std::filesystem::path& folder, std::uint64_t count, bool close = true,
                         std::uint64_t segment_bytes = 1 << 30) {
  SessionWriter writer(folder, SomeInfo(), segment_bytes);
  FrameCounts counts;
  for (; counts.stored < count; ++counts.stored) writer.Append(NumberedFrame(counts.stored));
  if (close) writer.Close(counts);
}

inline void Overwrite(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

// Whether every frame that the session offers is one that was recorded, unchanged, in order.
inline void ExpectOnlyTrueFrames(const Session& session) {
  std::int64_t last = -1;
  for (std::size_t i = 0; i < session.frames.size(); ++i) {
    const Frame frame = ReadFrame(session, i);
    ASSERT_EQ(frame.payload, NumberedFrame(frame.info.sequence).payload);
    ASSERT_GT(std::int64_t(frame.info.sequence), last);
    last = std::int64_t(frame.info.sequence);
  }
}

}  // namespace polarscan::test
