// SPDX-License-Identifier: Apache-2.0
#include "core/formats/ply.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cstring>
#include <fstream>

#include "core/error.h"
#include "core/random.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

class Ply : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("polarscan-ply-" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  PlyFile Read(const std::string& bytes) const {
    const fs::path path = folder_ / "file.ply";
    std::ofstream(path, std::ios::binary) << bytes;
    return ReadPly(path);
  }
  // Whether the damaged bytes are either refused with an Error or read as something; anything else ends the
  // test.
  bool Refuses(const std::string& bytes) const {
    try {
      Read(bytes);
      return false;
    } catch (const Error&) {
      return true;
    }
  }
  fs::path folder_;
};

template <class T>
std::string Bytes(T value, bool big) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (big) std::reverse(raw, raw + sizeof(T));
  return {raw, sizeof(T)};
}

constexpr const char* kHeaderRest =
    "comment made by hand\nelement vertex 3\nproperty float x\nproperty double y\nproperty uchar red\n"
    "element face 2\nproperty list uchar int vertex_indices\nproperty short tag\nend_header\n";

std::string Binary(bool big) {
  std::string bytes =
      std::string("ply\nformat binary_") + (big ? "big" : "little") + "_endian 1.0\n" + kHeaderRest;
  for (int i = 0; i < 3; ++i)
    bytes += Bytes(i + 0.5f, big) + Bytes(-1e10 * i, big) + Bytes(std::uint8_t(250 + i), big);
  bytes +=
      Bytes(std::uint8_t(3), big) + Bytes(0, big) + Bytes(1, big) + Bytes(2, big) + Bytes(short(-7), big);
  bytes += Bytes(std::uint8_t(4), big);
  for (int i : {2, 1, 0, 1}) bytes += Bytes(i, big);
  return bytes + Bytes(short(300), big);
}

const std::string kAscii = std::string("ply\r\nformat ascii 1.0\r\n") + kHeaderRest +
                           "0.5 -0 250\n1.5 -1e10 251\n2.5 -2e10 252\n3 0 1 2 -7\n4 2 1 0 1 300\n";

void ExpectTheExample(PlyFile file) {
  ASSERT_EQ(file["vertex"].count, 3u);
  EXPECT_EQ(file["vertex"].columns["x"], (std::vector<double>{0.5, 1.5, 2.5}));
  EXPECT_EQ(file["vertex"].columns["y"], (std::vector<double>{0, -1e10, -2e10}));
  EXPECT_EQ(file["vertex"].columns["red"], (std::vector<double>{250, 251, 252}));
  ASSERT_EQ(file["face"].count, 2u);
  EXPECT_EQ(file["face"].lists["vertex_indices"],
            (std::vector<std::vector<std::uint32_t>>{{0, 1, 2}, {2, 1, 0, 1}}));
  EXPECT_EQ(file["face"].columns["tag"], (std::vector<double>{-7, 300}));
}

TEST_F(Ply, AsciiAndBothByteOrdersSayTheSame) {
  ExpectTheExample(Read(kAscii));
  ExpectTheExample(Read(Binary(false)));
  ExpectTheExample(Read(Binary(true)));
}

TEST_F(Ply, EveryTruncationIsRefused) {
  for (const std::string& whole : {Binary(false), Binary(true)})
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_TRUE(Refuses(whole.substr(0, size))) << size;
  for (std::size_t size = 0; size + 4 < kAscii.size(); ++size)
    EXPECT_TRUE(Refuses(kAscii.substr(0, size))) << size;
}

TEST_F(Ply, AbsurdCountsAreRefusedBeforeAnythingIsAllocated) {
  for (const char* count :
       {"4", "1000000000000", "18446744073709551615", "99999999999999999999999", "-1", "x"}) {
    std::string bytes = Binary(false);
    bytes.replace(bytes.find("vertex 3"), 8, std::string("vertex ") + count);
    EXPECT_TRUE(Refuses(bytes)) << count;
  }
  const std::string list =
      "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint uchar i\nend_header\n";
  EXPECT_TRUE(Refuses(list + Bytes(std::uint32_t(4000000000u), false) + "abc"));
  const std::string ascii = "ply\nformat ascii 1.0\nelement face 1\nproperty list int int i\nend_header\n";
  EXPECT_TRUE(Refuses(ascii + "2000000000 1 2 3\n"));
  EXPECT_TRUE(Refuses(ascii + "-1 1 2 3\n"));
  EXPECT_FALSE(Refuses(ascii + "3 1 2 3\n"));
  EXPECT_TRUE(Refuses("ply\nformat ascii 1.0\nelement nothing 999999999999\nend_header\n"));
}

TEST_F(Ply, RandomDamageNeverCrashesTheReader) {
  const std::string whole = Binary(false);
  for (int trial = 0; trial < 2000; ++trial) {
    Random random(7, std::uint64_t(trial));
    std::string bytes = whole;
    for (int k = 0; k < 3; ++k) bytes[random.Below(std::uint32_t(bytes.size()))] = char(random.Below(256));
    Refuses(bytes);
  }
}

TEST_F(Ply, ErrorsNameTheFile) {
  try {
    Read("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\nabc\n");
    FAIL() << "a word was read as a number";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("file.ply"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("not a number"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace polarscan
