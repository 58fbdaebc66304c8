// SPDX-License-Identifier: Apache-2.0
// Sessions: what is written is read again, and whatever is done to the files, only true frames come out and
// all that is missing is named.
#include "session_helpers.h"

#include <cmath>

#include "acquisition/session/session_repair.h"
#include "core/error.h"

namespace polarscan::test {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kRecordBytes = kRecordHeaderBytes + 96;

TEST_F(SessionFolder, FramesComeBackBitForBitWithAllThatIsKnownAboutThem) {
  Frame frame = NumberedFrame(7);
  frame.info = {7, -5, 123456789, "PolarizeMono12Packed", 12, 8, 20, 1500.25, 6.5, NAN, 3, "a view"};
  {
    SessionWriter writer(session(), SomeInfo(), 1 << 20);
    writer.Append(frame);
    writer.AppendMissing(8, 2, "lost: never came");
    writer.Close({.stored = 1, .lost = 2});
  }
  const Session read = OpenSession(session(), Verify::kPayloads);
  ASSERT_EQ(read.frames.size(), 1u);
  const Frame again = ReadFrame(read, 0);
  EXPECT_EQ(again.payload, frame.payload);
  EXPECT_EQ(again.info.sequence, 7u);
  EXPECT_EQ(again.info.camera_time_ns, -5);
  EXPECT_EQ(again.info.host_time_ns, 123456789);
  EXPECT_EQ(again.info.pixel_format, "PolarizeMono12Packed");
  EXPECT_EQ(again.info.stride, 20);
  EXPECT_EQ(again.info.exposure_us, 1500.25);
  EXPECT_EQ(again.info.gain_db, 6.5);
  EXPECT_TRUE(std::isnan(again.info.temperature_c));
  EXPECT_EQ(again.info.shot, 3u);
  EXPECT_EQ(again.info.name, "a view");
  ASSERT_EQ(read.missing.size(), 1u);
  EXPECT_EQ(read.missing[0].first, 8u);
  EXPECT_EQ(read.missing[0].count, 2u);
  EXPECT_TRUE(read.info.closed);
  EXPECT_TRUE(read.damage.empty() && read.unfinished.empty());
}

TEST_F(SessionFolder, SegmentsEndAtTheirSizeAndReadAsOneSession) {
  WriteSession(session(), 10, true, 3 * kRecordBytes);
  EXPECT_TRUE(fs::exists(segment(3)));
  EXPECT_FALSE(fs::exists(segment(4)));
  const Session read = OpenSession(session(), Verify::kPayloads);
  EXPECT_EQ(read.frames.size(), 10u);
  EXPECT_TRUE(read.damage.empty());
  ExpectOnlyTrueFrames(read);
}

TEST_F(SessionFolder, AFolderWithAnythingInItIsNotRecordedInto) {
  WriteFileAtomically(session() / "thesis.txt", "irreplaceable");
  EXPECT_THROW(SessionWriter(session(), SomeInfo(), 1 << 20), Error);
  EXPECT_EQ(ReadFile(session() / "thesis.txt"), "irreplaceable");
  EXPECT_FALSE(IsSession(session()));
}

TEST_F(SessionFolder, CutAtAnyByteAnUnclosedSessionKeepsEveryFrameThatIsWhole) {
  WriteSession(session(), 4, false);
  const std::string whole = ReadFile(segment());
  ASSERT_EQ(whole.size(), 4 * kRecordBytes);
  for (std::size_t bytes = 2 * kRecordBytes; bytes <= whole.size(); ++bytes) {
    Overwrite(segment(), whole.substr(0, bytes));
    const Session read = OpenSession(session());
    ASSERT_EQ(read.frames.size(), bytes / kRecordBytes) << bytes;
    ASSERT_EQ(read.unfinished.size(), bytes % kRecordBytes ? 1u : 0u) << bytes;
    ASSERT_TRUE(read.damage.empty()) << bytes << read.damage[0];
    ExpectOnlyTrueFrames(read);
  }
}

TEST_F(SessionFolder, CutAtAnyByteAClosedSessionSaysThatItIsDamaged) {
  WriteSession(session(), 3);
  const std::string whole = ReadFile(segment());
  for (std::size_t bytes = kRecordBytes; bytes < whole.size(); ++bytes) {
    Overwrite(segment(), whole.substr(0, bytes));
    const Session read = OpenSession(session());
    ASSERT_EQ(read.frames.size(), bytes / kRecordBytes) << bytes;
    ASSERT_FALSE(read.damage.empty()) << bytes;
  }
}

TEST_F(SessionFolder, ATailOfZerosFromAPowerCutIsNotTakenForFrames) {
  WriteSession(session(), 3, false);
  std::string bytes = ReadFile(segment());
  std::fill(bytes.begin() + 2 * kRecordBytes + kRecordHeaderBytes, bytes.end(),
            '\0');  // header came, payload not
  Overwrite(segment(), bytes + std::string(1000, '\0'));
  const Session read = OpenSession(session());
  EXPECT_EQ(read.frames.size(), 2u);
  EXPECT_FALSE(read.unfinished.empty() && read.damage.empty());
  ExpectOnlyTrueFrames(read);
}

TEST_F(SessionFolder, EveryFlippedBitIsFoundAndCostsOneFrameAtMost) {
  WriteSession(session(), 5);
  const std::string whole = ReadFile(segment());
  Random random(1);
  for (int i = 0; i < 10000; ++i) {
    std::string bytes = whole;
    const std::size_t at = random.Below(std::uint32_t(whole.size()));
    bytes[at] = char(bytes[at] ^ (1 << random.Below(8)));
    Overwrite(segment(), bytes);
    const Session read = OpenSession(session(), Verify::kPayloads);
    ASSERT_EQ(read.frames.size(), 4u) << at;
    ASSERT_FALSE(read.damage.empty()) << at;
    ExpectOnlyTrueFrames(read);
  }
}

TEST_F(SessionFolder, AFrameDamagedSinceIsNeverHandedOut) {
  WriteSession(session(), 2);
  const Session read = OpenSession(session());
  std::string bytes = ReadFile(segment());
  bytes[kRecordHeaderBytes + 5] ^= 1;
  Overwrite(segment(), bytes);
  EXPECT_THROW(ReadFrame(read, 0), Error);
  EXPECT_EQ(ReadFrame(read, 1).payload, NumberedFrame(1).payload);
}

TEST_F(SessionFolder, AMissingSegmentIsNamed) {
  WriteSession(session(), 10, true, 3 * kRecordBytes);
  fs::remove(segment(1));
  const Session read = OpenSession(session());
  EXPECT_EQ(read.frames.size(), 7u);
  ASSERT_EQ(read.damage.size(), 1u);
  EXPECT_NE(read.damage[0].find("3 records before frame 6"), std::string::npos) << read.damage[0];
}

TEST_F(SessionFolder, FramesThatWereStoredBeforeAreNamedAndLeftOut) {
  WriteSession(session(), 4);
  const std::string whole = ReadFile(segment());
  Overwrite(segment(), whole + whole);
  const Session doubled = OpenSession(session(), Verify::kPayloads);
  EXPECT_EQ(doubled.frames.size(), 4u);
  EXPECT_EQ(doubled.info.counts.stored, 4u);
  ASSERT_EQ(doubled.damage.size(), 4u);
  EXPECT_NE(doubled.damage[0].find("frame 0 is there twice"), std::string::npos) << doubled.damage[0];
  Overwrite(segment(), whole);
  Overwrite(segment(1), whole);
  EXPECT_EQ(OpenSession(session()).frames.size(), 4u) << "a copy of a segment";
}

TEST_F(SessionFolder, SegmentsInAnotherOrderLoseNothing) {
  WriteSession(session(), 6, true, 3 * kRecordBytes);
  const std::string first = ReadFile(segment()), second = ReadFile(segment(1));
  Overwrite(segment(), second);
  Overwrite(segment(1), first);
  const Session read = OpenSession(session(), Verify::kPayloads);
  EXPECT_TRUE(read.damage.empty()) << read.damage[0];
  ASSERT_EQ(read.frames.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(read.frames[i].info.sequence, i);
  ExpectOnlyTrueFrames(read);
}

TEST_F(SessionFolder, RecordsOfAnotherSessionAreNotTakenForThisOnes) {
  WriteSession(session(), 2, false);
  WriteSession(folder_ / "other", 3);
  Overwrite(segment(), ReadFile(segment()) + ReadFile(SegmentPath(folder_ / "other", 0)));
  EXPECT_EQ(OpenSession(session()).frames.size(), 2u);
}

TEST_F(SessionFolder, RandomBytesNeverCrashTheReader) {
  WriteSession(session(), 1, false);
  Random random(2);
  for (int i = 0; i < 300; ++i) {
    std::string bytes;
    for (std::uint32_t n = random.Below(2000); n > 0; --n) bytes.push_back(char(random.Below(256)));
    if (i % 3 == 0) bytes.insert(bytes.size() / 2, kRecordMagic);
    Overwrite(segment(), bytes);
    ASSERT_TRUE(OpenSession(session()).frames.empty());
  }
}

TEST_F(SessionFolder, RepairCutsTheTailOffAndClosesTheSession) {
  WriteSession(session(), 3, false);
  fs::resize_file(segment(), fs::file_size(segment()) - 10);
  Session read = OpenSession(session());
  RepairSession(read);
  EXPECT_EQ(fs::file_size(segment()), 2 * kRecordBytes);
  EXPECT_TRUE(read.info.closed);
  EXPECT_TRUE(read.damage.empty() && read.unfinished.empty());
  EXPECT_EQ(read.info.counts.stored, 2u);
  ExpectOnlyTrueFrames(read);
}

TEST_F(SessionFolder, ReasonsThatAreNoUtf8AreRepairedToo) {
  {
    SessionWriter writer(session(), SomeInfo(), 1 << 20);
    writer.AppendMissing(8, 2, "lost: \x96\xff");  // found by a fuzzer
  }
  Session read = OpenSession(session());
  RepairSession(read);
  EXPECT_TRUE(OpenSession(session()).info.closed);
  EXPECT_EQ(read.missing.at(0).count, 2u);
  EXPECT_NE(ReadFile(session() / "session.json").find("\xEF\xBF\xBD"), std::string::npos)
      << "the replacement";
}

TEST_F(SessionFolder, ASessionJsonOfAnotherKindIsAnErrorThatNamesIt) {
  EXPECT_THROW(OpenSession(session()), Error);
  for (const char* text : {"", "{", "[]", "{}", R"({"format": "polarscan session", "version": 2})",
                           R"({"format": "polarscan session", "version": 1})"}) {
    WriteFileAtomically(session() / "session.json", text);
    EXPECT_THROW(OpenSession(session()), Error) << text;
  }
}

}  // namespace
}  // namespace polarscan::test
