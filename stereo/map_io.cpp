// SPDX-License-Identifier: Apache-2.0
#include "stereo/map_io.h"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cstring>

#include "core/error.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

static_assert(std::endian::native == std::endian::little, "map files are little endian");
constexpr int kLongestSide = 1 << 16;  // pixels a side

const char* const kMapAdvice = "Remove it and run the same command again; it is made anew";

// Reads "123&" at `position` and moves behind it; 0 if there is no such number.
int ReadNumber(const std::string& bytes, std::size_t& position) {
  const std::size_t end = bytes.find('&', position);
  if (end == std::string::npos || end - position > 6) return 0;
  int value = 0;
  const auto [stop, error] = std::from_chars(bytes.data() + position, bytes.data() + end, value);
  const bool good = error == std::errc() && stop == bytes.data() + end;
  position = end + 1;
  return good && value > 0 && value <= kLongestSide ? value : 0;
}

// The planes of a map file with exactly `channels` of them.
std::vector<Image<float>> ReadPlanes(const std::filesystem::path& path, int channels) {
  const std::string bytes = ReadFile(path);
  std::size_t position = 0;
  const int width = ReadNumber(bytes, position);
  const int height = width ? ReadNumber(bytes, position) : 0;
  const int found = height ? ReadNumber(bytes, position) : 0;
  if (found != channels)
    throw Error(fmt::format("not a map file with {} channel(s)", channels), path.string(), kMapAdvice);
  const std::size_t plane = std::size_t(width) * std::size_t(height) * sizeof(float);
  if (bytes.size() - position != plane * std::size_t(channels))
    throw Error(fmt::format("the map file has {} bytes of data, but {} x {} x {} floats need {}",
                            bytes.size() - position, width, height, channels, plane * std::size_t(channels)),
                path.string(), kMapAdvice);
  std::vector<Image<float>> planes(std::size_t(channels), Image<float>(width, height));
  for (Image<float>& image : planes) {
    std::memcpy(image.row(0), bytes.data() + position, plane);
    position += plane;
  }
  return planes;
}

std::string Header(int width, int height, int channels) {
  return fmt::format("{}&{}&{}&", width, height, channels);
}

void Append(std::string& bytes, const float* values, std::size_t count) {
  bytes.append(reinterpret_cast<const char*>(values), count * sizeof(float));
}

}  // namespace

Image<float> ReadDepthMap(const std::filesystem::path& path) { return std::move(ReadPlanes(path, 1)[0]); }

Image<Eigen::Vector3f> ReadNormalMap(const std::filesystem::path& path) {
  const std::vector<Image<float>> planes = ReadPlanes(path, 3);
  Image<Eigen::Vector3f> normals(planes[0].width(), planes[0].height(), Eigen::Vector3f::Zero());
  for (std::size_t i = 0; i < normals.size(); ++i)
    normals.pixels()[i] = {planes[0].pixels()[i], planes[1].pixels()[i], planes[2].pixels()[i]};
  return normals;
}

void WriteDepthMap(const std::filesystem::path& path, const Image<float>& depth) {
  std::string bytes = Header(depth.width(), depth.height(), 1);
  Append(bytes, depth.pixels().data(), depth.size());
  WriteFileAtomically(path, bytes);
}

void WriteNormalMap(const std::filesystem::path& path, const Image<Eigen::Vector3f>& normals) {
  std::string bytes = Header(normals.width(), normals.height(), 3);
  std::vector<float> plane(normals.size());
  for (int channel = 0; channel < 3; ++channel) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane[i] = normals.pixels()[i][channel];
    Append(bytes, plane.data(), plane.size());
  }
  WriteFileAtomically(path, bytes);
}

}  // namespace polarscan
