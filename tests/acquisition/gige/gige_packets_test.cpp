// SPDX-License-Identifier: Apache-2.0
// The packets of GigE Vision, byte for byte, and how its frames are numbered.
#include "simulation/gige/protocol.h"

#include <gtest/gtest.h>

#include "acquisition/camera/frame_numbers.h"

namespace polarscan::test {
namespace {

TEST(GigePackets, AReadCommandIsParsedAndAnsweredByteForByte) {
  const Bytes datagram = {0x42, 0x01, 0x00, 0x80, 0x00, 0x04, 0x12, 0x34, 0x00, 0x00, 0x0A, 0x00};
  const auto command = gvcp::Parse(datagram);
  ASSERT_TRUE(command);
  EXPECT_EQ(command->command, gvcp::kReadRegister);
  EXPECT_TRUE(command->wants_answer);
  EXPECT_EQ(GetBig<std::uint32_t>(command->payload, 0), 0x0A00u);
  EXPECT_EQ(gvcp::Acknowledge(*command, Bytes{0, 0, 0, 2}),
            (Bytes{0, 0, 0x00, 0x81, 0x00, 0x04, 0x12, 0x34, 0, 0, 0, 2}));
  EXPECT_EQ(gvcp::Refuse(*command, gvcp::kAccessDenied),
            (Bytes{0x80, 0x06, 0x00, 0x81, 0x00, 0x00, 0x12, 0x34}));
}

TEST(GigePackets, WhatIsCutOffOrNotGvcpIsNoCommand) {
  const Bytes whole = {0x42, 0x01, 0x00, 0x80, 0x00, 0x04, 0x12, 0x34, 0x00, 0x00, 0x0A, 0x00};
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(gvcp::Parse(ByteView(whole).first(size)));
  Bytes other = whole;
  other[0] = 0x43;
  EXPECT_FALSE(gvcp::Parse(other));
}

TEST(GigePackets, ALeaderHoldsFormatAndSize) {
  const Bytes leader = gvsp::Leader({7, 0x0102030405060708, 0x01080001, 2448, 2048, 0, 0, 2448 * 2048});
  EXPECT_EQ(leader, (Bytes{0, 0, 0, 7, 1,    0,    0, 0, 0,    0, 0, 1, 1, 2, 3, 4, 5, 6, 7, 8, 0x01, 0x08,
                           0, 1, 0, 0, 0x09, 0x90, 0, 0, 0x08, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,    0}));
  EXPECT_EQ(gvsp::DataPackets(1000, 536), 2u);
  EXPECT_EQ(gvsp::DataPackets(1001, 536), 3u);
}

TEST(FrameNumbersTest, SixteenBitNumbersGoOnOverTheWrapWhichLeavesZeroOut) {
  FrameNumbers numbers(true);
  EXPECT_EQ(numbers.Unwrap(65533), 0u);
  EXPECT_EQ(numbers.Unwrap(65534), 1u);
  EXPECT_EQ(numbers.Unwrap(65535), 2u);
  EXPECT_EQ(numbers.Unwrap(1), 3u);
  EXPECT_EQ(numbers.Unwrap(3), 5u);  // 2 is lost
  EXPECT_EQ(numbers.Unwrap(2), 4u);  // no, late
  EXPECT_EQ(numbers.Unwrap(4), 6u);
}

TEST(FrameNumbersTest, TheFirstFramesMayBeMissing) {
  FrameNumbers gige(true), usb(false);
  EXPECT_EQ(gige.Unwrap(3), 2u);
  EXPECT_EQ(gige.Unwrap(4), 3u);
  EXPECT_EQ(usb.Unwrap(1), 1u);
}

TEST(FrameNumbersTest, LongNumbersAreTakenAsTheyAre) {
  FrameNumbers gige(true), usb(false);
  EXPECT_EQ(gige.Unwrap(65535), 0u);
  EXPECT_EQ(gige.Unwrap(65536), 1u);
  EXPECT_EQ(gige.Unwrap(65540), 5u);
  EXPECT_EQ(usb.Unwrap(0), 0u);
  EXPECT_EQ(usb.Unwrap(70000), 70000u);
}

}  // namespace
}  // namespace polarscan::test
