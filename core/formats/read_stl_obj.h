// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace polarscan {

// Triangles that share nothing: three corners each, outward by the right-hand rule as the file has them.
struct TriangleCorners {
  std::vector<Eigen::Vector3d> points;   // three a triangle, finite
  std::vector<Eigen::Vector3d> normals;  // one a point, of any length above 0; empty: not all have one
};

// The text or bytes of an STL file, binary or ascii; the normals of its facets are not read, since the
// corners tell them. `where` is the file's name. Throws Error on a damaged file.
TriangleCorners ParseStl(const std::string& bytes, const std::string& where);

// The text of a Wavefront OBJ: v, vn and f with any polygons, which are split into fans, and negative
// indices; everything else is passed over. Throws Error, with the line, on a damaged file.
TriangleCorners ParseObj(const std::string& text, const std::string& where);

}  // namespace polarscan
