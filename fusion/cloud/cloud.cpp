// SPDX-License-Identifier: Apache-2.0
#include "fusion/cloud/cloud.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/error.h"
#include "core/files/bytes.h"
#include "core/files/files.h"
#include "core/formats/ply.h"

namespace polarscan {
namespace {

constexpr const char* kFuseAgain = "Run polarscan fuse SCAN, which makes the cloud again";

constexpr std::size_t kBytesPerPoint = 37;

// One column, or `otherwise` in each row if it is missing.
std::vector<double> Column(const PlyElement& vertex, const std::string& name, double otherwise) {
  const auto found = vertex.columns.find(name);
  return found == vertex.columns.end() ? std::vector<double>(vertex.count, otherwise) : found->second;
}

std::uint8_t ToByte(double value) { return std::uint8_t(std::clamp(value, 0.0, 255.0)); }

std::string Header(std::size_t count, const std::string& comment,
                   const Eigen::Vector3d& offset = Eigen::Vector3d::Zero()) {
  return fmt::format("ply\nformat binary_little_endian 1.0\n{}{}element vertex {}\n{}end_header\n",
                     PlyOffsetLine(offset), comment.empty() ? "" : "comment " + comment + "\n", count,
                     PointProperties());
}

}  // namespace

std::vector<Eigen::Vector3d> Positions(const std::vector<CloudPoint>& cloud) {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(cloud.size());
  for (const CloudPoint& p : cloud) positions.push_back(p.position.cast<double>());
  return positions;
}

std::string PointProperties() {
  return "property float x\nproperty float y\nproperty float z\n"
         "property float nx\nproperty float ny\nproperty float nz\n"
         "property uchar red\nproperty uchar green\nproperty uchar blue\n"
         "property float dop\nproperty float confidence\nproperty ushort views\n";
}

void AppendPoint(std::string& bytes, const CloudPoint& p) {
  for (int k = 0; k < 3; ++k) AppendBytes(bytes, p.position[k]);
  for (int k = 0; k < 3; ++k) AppendBytes(bytes, p.normal[k]);
  for (std::uint8_t c : {p.colour.r, p.colour.g, p.colour.b}) AppendBytes(bytes, c);
  AppendBytes(bytes, p.dop);
  AppendBytes(bytes, p.confidence);
  AppendBytes(bytes, p.views);
}

void WriteCloud(const std::filesystem::path& path, const std::vector<CloudPoint>& points,
                const std::string& comment) {
  std::string bytes = Header(points.size(), comment);
  bytes.reserve(bytes.size() + kBytesPerPoint * points.size());
  for (const CloudPoint& p : points) AppendPoint(bytes, p);
  WriteFileAtomically(path, bytes);
}

CloudWriter::CloudWriter(const std::filesystem::path& path, const std::string& comment,
                         const Eigen::Vector3d& offset)
    : path_(path), comment_(comment), offset_(offset), file_(path, std::ios::binary) {
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
  return Header(points_, comment_ + std::string(kMostDigits - std::to_string(points_).size(), ' '), offset_);
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
    for (int k = 0; k < 3; ++k) AppendBytes(bytes, float(points[i][k]));
    AppendBytes(bytes, float(errors[i]));
  }
  WriteFileAtomically(path, bytes);
}

std::vector<CloudPoint> ReadCloud(const std::filesystem::path& path) {
  const PlyFile ply = ReadPly(path);
  const auto vertex = ply.find("vertex");
  if (vertex == ply.end()) throw Error("the PLY file has no vertices", path.string(), kFuseAgain);
  const PlyElement& element = vertex->second;
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"})
    if (!element.columns.contains(name))
      throw Error(fmt::format("the cloud's points have no {}", name), path.string(), kFuseAgain);
  std::array<std::vector<double>, 12> columns;
  const char* const names[] = {"x",   "y",     "z",    "nx",  "ny",         "nz",
                               "red", "green", "blue", "dop", "confidence", "views"};
  for (std::size_t k = 0; k < 12; ++k) columns[k] = Column(element, names[k], k == 10 ? 1 : 0);
  std::vector<CloudPoint> points;
  points.reserve(element.count);
  for (std::size_t i = 0; i < element.count; ++i) {
    const auto at = [&](std::size_t k) { return columns[k][i]; };
    const Eigen::Vector3d position(at(0), at(1), at(2)), normal(at(3), at(4), at(5));
    if (!position.allFinite() || !normal.allFinite() || normal.norm() < 1e-6) continue;
    points.push_back({position.cast<float>(), normal.normalized().cast<float>(),
                      Rgb8{ToByte(at(6)), ToByte(at(7)), ToByte(at(8))}, float(at(9)), float(at(10)),
                      std::uint16_t(std::clamp(at(11), 0.0, 65535.0))});
  }
  if (points.empty()) throw Error("the cloud has no points with a normal", path.string(), kFuseAgain);
  return points;
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
