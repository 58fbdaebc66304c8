// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>

#include "acquisition/input/input.h"
#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

template <class T>
std::string BytesOf(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

std::string Attribute(const std::string& name, const std::string& type, const std::string& value) {
  return name + '\0' + type + '\0' + BytesOf(std::int32_t(value.size())) + value;
}

// An uncompressed float32 EXR file as its specification says, written without the library that reads it
// (openexr.com, "OpenEXR File Layout"). Channels: names in alphabetical order with the value of all their
// pixels.
std::string Exr(int width, int height, const std::vector<std::pair<std::string, float>>& channels) {
  std::string list, box = BytesOf(std::int32_t(0)) + BytesOf(std::int32_t(0)) +
                          BytesOf(std::int32_t(width - 1)) + BytesOf(std::int32_t(height - 1));
  for (const auto& [name, value] : channels)
    list += name + '\0' + BytesOf(std::int32_t(2)) + BytesOf(std::int32_t(0)) + BytesOf(std::int32_t(1)) +
            BytesOf(std::int32_t(1));
  std::string file = BytesOf(std::int32_t(20000630)) + BytesOf(std::int32_t(2));
  file += Attribute("channels", "chlist", list + '\0') + Attribute("compression", "compression", {'\0'});
  file += Attribute("dataWindow", "box2i", box) + Attribute("displayWindow", "box2i", box);
  file += Attribute("lineOrder", "lineOrder", {'\0'}) + Attribute("pixelAspectRatio", "float", BytesOf(1.0f));
  file += Attribute("screenWindowCenter", "v2f", BytesOf(0.0f) + BytesOf(0.0f));
  file += Attribute("screenWindowWidth", "float", BytesOf(1.0f)) + '\0';
  const std::size_t line = 4 * std::size_t(width) * channels.size(),
                    first = file.size() + 8 * std::size_t(height);
  for (int y = 0; y < height; ++y) file += BytesOf(std::uint64_t(first + std::size_t(y) * (line + 8)));
  for (int y = 0; y < height; ++y) {
    file += BytesOf(std::int32_t(y)) + BytesOf(std::int32_t(line));
    for (const auto& [name, value] : channels)
      for (int x = 0; x < width; ++x) file += BytesOf(value);
  }
  return file;
}

class ExrInput : public testing::Test {
 protected:
  ExrInput() : folder_(fs::temp_directory_path() / ("polarscan-exr-" + std::to_string(::getpid()))) {
    fs::remove_all(folder_);
  }
  ~ExrInput() override { fs::remove_all(folder_); }
  void Write(const std::string& name, const std::vector<std::pair<std::string, float>>& channels) const {
    WriteFileAtomically(folder_ / name, Exr(6, 5, channels));
  }
  fs::path folder_;
};

TEST_F(ExrInput, StokesPicturesInColour) {
  Write("stokes/v_s0.exr", {{"B", 0.1f}, {"G", 0.2f}, {"R", 3.0f}});
  Write("stokes/v_s1.exr", {{"B", -0.1f}, {"G", -0.2f}, {"R", -0.3f}});
  Write("stokes/v_s2.exr", {{"B", 0}, {"G", 0.5f}, {"R", 0}});
  const Input input = OpenInput(folder_, {});
  EXPECT_EQ(input.kind, InputKind::kStokes);
  const LoadedView view = ReadView(input, 0);
  ASSERT_EQ(view.pictures.size(), 3u);
  ASSERT_EQ(view.pictures[0].planes.size(), 3u);
  EXPECT_FLOAT_EQ(view.pictures[0].planes[0](5, 4), 3.0f);   // red, above 1: nothing is cut off
  EXPECT_FLOAT_EQ(view.pictures[1].planes[2](0, 0), -0.1f);  // blue, below 0
}

TEST_F(ExrInput, GreyPicturesBehindAPolarizer) {
  for (const char* angle : {"0", "45", "90", "135"}) Write(std::string(angle) + "/v.exr", {{"Y", 0.25f}});
  const Input input = OpenInput(folder_, {});
  EXPECT_EQ(input.kind, InputKind::kAngles);
  EXPECT_EQ(input.sensor.bits, 32);
  EXPECT_FALSE(input.sensor.clips);
  EXPECT_FLOAT_EQ(ReadView(input, 0).pictures[3].planes[0](2, 2), 0.25f);
}

TEST_F(ExrInput, StokesInTheChannelsOfOneFileAsRenderersWriteThem) {
  Write("000000.exr", {{"B", 1},
                       {"G", 1},
                       {"R", 1},
                       {"S0.B", 0.1f},
                       {"S0.G", 0.2f},
                       {"S0.R", 3.0f},
                       {"S1.B", -0.1f},
                       {"S1.G", -0.2f},
                       {"S1.R", -0.3f},
                       {"S2.B", 0},
                       {"S2.G", 0.5f},
                       {"S2.R", 0},
                       {"S3.B", 9},
                       {"S3.G", 9},
                       {"S3.R", 9}});
  const Input input = OpenInput(folder_, {});
  EXPECT_EQ(input.kind, InputKind::kStokes);
  const LoadedView view = ReadView(input, 0);
  ASSERT_EQ(view.pictures.size(), 3u);
  ASSERT_EQ(view.pictures[2].planes.size(), 3u);
  EXPECT_EQ(view.pictures[0].planes[0](5, 4), 3.0f);
  EXPECT_EQ(view.pictures[1].planes[2](0, 0), -0.1f);
  EXPECT_EQ(view.pictures[2].planes[1](3, 3), 0.5f);

  const Input photos = OpenInput(folder_, {.kind = "photos"});
  ASSERT_EQ(photos.warnings.size(), 1u);
  EXPECT_NE(photos.warnings[0].find("S0.B, S0.G, S0.R and 9 more"), std::string::npos) << photos.warnings[0];

  Write("000000.exr", {{"S0", 2}, {"S1", 0.5f}, {"S2", -0.5f}, {"S3", 0}});
  EXPECT_EQ(ReadView(OpenInput(folder_, {}), 0).pictures[2].planes[0](1, 1), -0.5f);
}

TEST_F(ExrInput, ChannelsThatAreNoPictureAreNamed) {
  Write("a.exr", {{"S0.R", 2}, {"S1.R", 0.5f}});
  for (const char* kind : {"auto", "stokes", "photos"}) {
    try {
      OpenInput(folder_, {.kind = kind});
      FAIL() << kind;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("its channels are S0.R, S1.R"), std::string::npos)
          << error.what();
      EXPECT_NE(std::string(error.what()).find("S0 S1 S2"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace polarscan
