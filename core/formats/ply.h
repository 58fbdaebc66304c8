// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace polarscan {

// The elements of a PLY file by name, each with its scalar properties as columns of doubles and its list
// properties (faces) as vectors of rows. Ascii and binary of either byte order. Counts are checked against
// the file's size before anything is allocated; a damaged or truncated file throws Error.
struct PlyElement {
  std::size_t count = 0;
  std::map<std::string, std::vector<double>> columns;
  std::map<std::string, std::vector<std::vector<std::uint32_t>>> lists;
};
using PlyFile = std::map<std::string, PlyElement>;

PlyFile ReadPly(const std::filesystem::path& path);

// The header's line "comment offset X Y Z": what to add to the file's coordinates for the world's (double
// precision). Nothing for 0; and 0 for a file without it, or that is none.
std::string PlyOffsetLine(const Eigen::Vector3d& offset);
Eigen::Vector3d ReadPlyOffset(const std::filesystem::path& path);

}  // namespace polarscan
