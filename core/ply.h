// SPDX-License-Identifier: Apache-2.0
#pragma once
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

}  // namespace polarscan
