// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/image.h"

namespace polarscan {

// A fused surface point, world frame and units.
struct CloudPoint {
  Eigen::Vector3f position, normal;  // normal: unit, towards the cameras that saw it
  Rgb8 colour;
  float dop = 0;            // degree of linear polarization, 0 to 1: mean over the agreeing views
  float confidence = 0;     // 0 to 1, see fusion/cloud/consistency.h
  std::uint16_t views = 0;  // that agree, the reference view included; those of one place count as one
};

std::vector<Eigen::Vector3d> Positions(const std::vector<CloudPoint>& cloud);

// Binary little-endian PLY: x y z nx ny nz (float), red green blue (uchar), dop confidence (float), views
// (ushort). MeshLab reads the first nine, CloudCompare the rest as scalar fields. `comment` becomes a comment
// line. Atomic.
void WriteCloud(const std::filesystem::path& path, const std::vector<CloudPoint>& points,
                const std::string& comment = "");

// What the cloud's points are in a PLY file: the lines of the header, and a point's bytes.
std::string PointProperties();
void AppendPoint(std::string& bytes, const CloudPoint& point);

// A cloud back from its file, or another program's: x y z nx ny nz are needed (points that are not finite, or
// without a normal, are left out); what else is missing is 0, its confidence 1. Throws Error on a damaged
// file, and on one without normals or points.
std::vector<CloudPoint> ReadCloud(const std::filesystem::path& path);

// The same, point by point, without keeping them: to a temporary file of core/files/files.h's
// WriteAtomically. The count comes last; blanks at the end of the comment make room for it. Throws Error if
// the disk fails.
class CloudWriter {
 public:
  // offset: of the cloud's frame (core/formats/ply.h).
  CloudWriter(const std::filesystem::path& path, const std::string& comment, const Eigen::Vector3d& offset);
  void Add(const std::vector<CloudPoint>& points);
  void Finish();
  std::size_t points() const { return points_; }

 private:
  std::string PaddedHeader() const;
  void Write(const std::string& bytes);

  std::filesystem::path path_;
  std::string comment_;
  Eigen::Vector3d offset_;
  std::size_t points_ = 0;
  std::ofstream file_;
};

// The distance of each point to the true surface, for CloudCompare and the report: binary PLY, x y z error
// (float). Atomic.
void WriteCloudErrors(const std::filesystem::path& path, const std::vector<Eigen::Vector3d>& points,
                      const std::vector<double>& errors);

// Finite positions of any PLY with x, y and z, and how many were left out for not being finite.
struct CloudPositions {
  std::vector<Eigen::Vector3d> points;
  std::size_t not_finite = 0;
};
CloudPositions ReadCloudPositions(const std::filesystem::path& path);

}  // namespace polarscan
