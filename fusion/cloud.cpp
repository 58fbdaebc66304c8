// SPDX-License-Identifier: Apache-2.0
#include "fusion/cloud.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>

#include "core/error.h"
#include "core/files.h"
#include "core/ply.h"

namespace polarscan {
namespace {

static_assert(std::endian::native == std::endian::little, "WriteCloud copies little-endian numbers");

std::string Header(std::size_t count, const std::string& comment) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\n{}element vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property float dop\nproperty float confidence\nproperty ushort views\nend_header\n",
      comment.empty() ? "" : "comment " + comment + "\n", count);
}

template <class T>
void Append(std::string& bytes, const T& value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

constexpr std::size_t kBytesPerPoint = 37;

void AppendPoint(std::string& bytes, const CloudPoint& p) {
  for (int k = 0; k < 3; ++k) Append(bytes, p.position[k]);
  for (int k = 0; k < 3; ++k) Append(bytes, p.normal[k]);
  for (std::uint8_t channel : {p.colour.r, p.colour.g, p.colour.b}) Append(bytes, channel);
  Append(bytes, p.dop);
  Append(bytes, p.confidence);
  Append(bytes, p.views);
}

}  // namespace

void WriteCloud(const std::filesystem::path& path, const std::vector<CloudPoint>& points,
                const std::string& comment) {
  std::string bytes = Header(points.size(), comment);
  bytes.reserve(bytes.size() + kBytesPerPoint * points.size());
  for (const CloudPoint& p : points) AppendPoint(bytes, p);
  WriteFileAtomically(path, bytes);
}

CloudWriter::CloudWriter(const std::filesystem::path& path, const std::string& comment)
    : path_(path), comment_(comment), file_(path, std::ios::binary) {
  Write(PaddedHeader());
}

void CloudWriter::Add(const std::vector<CloudPoint>& points) {
  std::string bytes;
  bytes.reserve(kBytesPerPoint * points.size());
  for (const CloudPoint& p : points) AppendPoint(bytes, p);
  Write(bytes);
  points_ += points.size();
}

void CloudWriter::Finish() {
  file_.seekp(0);
  Write(PaddedHeader());
  file_.close();
  if (!file_) ThrowSystemError("cannot write the file", path_);
}

// As long for every count.
std::string CloudWriter::PaddedHeader() const {
  constexpr std::size_t kMostDigits = 20;
  return Header(points_, comment_ + std::string(kMostDigits - std::to_string(points_).size(), ' '));
}

void CloudWriter::Write(const std::string& bytes) {
  if (!file_.write(bytes.data(), std::streamsize(bytes.size())))
    ThrowSystemError("cannot write the file", path_);
}

void WriteCloudErrors(const std::filesystem::path& path, const std::vector<Eigen::Vector3d>& points,
                      const std::vector<double>& errors) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\nproperty float error\nend_header\n",
      points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int k = 0; k < 3; ++k) Append(bytes, float(points[i][k]));
    Append(bytes, float(errors[i]));
  }
  WriteFileAtomically(path, bytes);
}

CloudPositions ReadCloudPositions(const std::filesystem::path& path) {
  const PlyFile ply = ReadPly(path);
  const auto vertex = ply.find("vertex");
  if (vertex == ply.end()) throw Error("the PLY file has no vertices", path.string());
  const auto& columns = vertex->second.columns;
  for (const char* axis : {"x", "y", "z"})
    if (!columns.contains(axis))
      throw Error(fmt::format("the PLY file's vertices have no {}", axis), path.string());
  const auto &x = columns.at("x"), &y = columns.at("y"), &z = columns.at("z");
  CloudPositions cloud;
  cloud.points.reserve(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Eigen::Vector3d p(x[i], y[i], z[i]);
    if (p.allFinite()) cloud.points.push_back(p);
  }
  cloud.not_finite = x.size() - cloud.points.size();
  return cloud;
}

}  // namespace polarscan
