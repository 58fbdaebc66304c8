// SPDX-License-Identifier: Apache-2.0
#include "core/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/files/bytes.h"
#include "core/files/files.h"
#include "core/formats/ply.h"
#include "core/formats/read_stl_obj.h"
#include "core/words.h"

namespace polarscan {
namespace {

constexpr const char* kExportAgain = "Export the mesh again as a PLY with x y z and vertex_indices";

// Three columns of an element as points; empty if one of them is missing.
std::vector<Eigen::Vector3d> Points(const PlyElement& element, const std::array<const char*, 3>& names) {
  std::array<const std::vector<double>*, 3> columns{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto found = element.columns.find(names[i]);
    if (found == element.columns.end()) return {};
    columns[i] = &found->second;
  }
  std::vector<Eigen::Vector3d> points(element.count);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = {(*columns[0])[i], (*columns[1])[i], (*columns[2])[i]};
  return points;
}

std::vector<std::array<std::uint32_t, 3>> Triangles(const PlyFile& file, std::size_t vertex_count,
                                                    const std::string& where) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  const auto face = file.find("face");
  if (face == file.end()) return triangles;
  for (const auto& [name, rows] : face->second.lists) {
    if (name != "vertex_indices" && name != "vertex_index") continue;
    for (const std::vector<std::uint32_t>& row : rows) {
      for (std::uint32_t index : row)
        if (index >= vertex_count)
          throw Error("a face names a vertex that is not there", where, kExportAgain);
      for (std::size_t i = 2; i < row.size(); ++i) triangles.push_back({row[0], row[i - 1], row[i]});
    }
  }
  return triangles;
}

// Whether there is a usable normal for each vertex; makes them unit length.
bool NormalizeNormals(TriangleMesh& mesh) {
  if (mesh.normals.size() != mesh.vertices.size()) return false;
  for (Eigen::Vector3d& n : mesh.normals) {
    const double length = n.norm();
    if (!(length > 1e-12) || !std::isfinite(length)) return false;
    n /= length;
  }
  return true;
}

void AppendVector(std::string& bytes, const Eigen::Vector3d& v) {
  for (int i = 0; i < 3; ++i) AppendBytes(bytes, float(v[i]));
}

double SegmentDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d d = b - a;
  const double length = d.squaredNorm();
  const double t = length > 0 ? std::clamp((p - a).dot(d) / length, 0.0, 1.0) : 0;
  return (p - a - t * d).norm();
}

TriangleMesh ReadPlyMesh(const std::filesystem::path& path) {
  const PlyFile file = ReadPly(path);
  const auto vertex = file.find("vertex");
  if (vertex == file.end()) throw Error("a PLY without vertices", path.string(), kExportAgain);
  TriangleMesh mesh;
  mesh.vertices = Points(vertex->second, {"x", "y", "z"});
  if (mesh.vertices.empty()) throw Error("a PLY without vertices", path.string(), kExportAgain);
  if (!std::ranges::all_of(mesh.vertices, [](const auto& point) { return point.allFinite(); }))
    throw Error("a vertex that is not a finite point", path.string(), kExportAgain);
  mesh.triangles = Triangles(file, mesh.vertices.size(), path.string());
  if (mesh.triangles.empty()) throw Error("a PLY without faces", path.string(), kExportAgain);
  mesh.normals = Points(vertex->second, {"nx", "ny", "nz"});
  if (!NormalizeNormals(mesh)) ComputeVertexNormals(mesh);
  return mesh;
}

// Where facets meet at more than this they share no vertex, so that an edge of a part stays an edge.
constexpr double kCreaseCos = 0.866;  // 30 degrees
constexpr double kSameCos = 1 - 1e-9;

// Corners at the same place become one vertex, if their normals (or else their facets') are alike.
TriangleMesh Weld(const TriangleCorners& corners) {
  struct Vertex {
    Eigen::Vector3d normal;
    std::uint32_t index;
  };
  std::map<std::array<double, 3>, std::vector<Vertex>> at;
  TriangleMesh mesh;
  const bool has_normals = !corners.normals.empty();
  const double alike = has_normals ? kSameCos : kCreaseCos;
  for (std::size_t i = 0; i < corners.points.size(); ++i) {
    const Eigen::Vector3d &p = corners.points[i], *facet = &corners.points[i / 3 * 3];
    const Eigen::Vector3d normal =
        (has_normals ? corners.normals[i] : (facet[1] - facet[0]).cross(facet[2] - facet[0]).eval())
            .normalized();
    std::vector<Vertex>& here = at[{p.x() + 0.0, p.y() + 0.0, p.z() + 0.0}];  // -0 is 0
    const auto found = std::ranges::find_if(
        here, [&](const Vertex& v) { return !(v.normal.dot(normal) < alike) || normal.isZero(); });
    std::uint32_t index = std::uint32_t(mesh.vertices.size());
    if (found != here.end()) {
      index = found->index;
    } else {
      here.push_back({normal, index});
      mesh.vertices.push_back(p);
      if (has_normals) mesh.normals.push_back(normal);
    }
    if (i % 3 == 0) mesh.triangles.emplace_back();
    mesh.triangles.back()[i % 3] = index;
  }
  if (!has_normals) ComputeVertexNormals(mesh);
  return mesh;
}

TriangleMesh ReadAnyMesh(const std::filesystem::path& path) {
  const std::string ending = LowerExtension(path);
  if (ending == ".ply") return ReadPlyMesh(path);
  const std::string bytes = ReadFile(path);
  if (bytes.starts_with("ply")) return ReadPlyMesh(path);
  if (ending != ".stl" && ending != ".obj")
    throw Error("meshes of this kind are not read", path.string(), "Export it as PLY, STL or OBJ");
  const TriangleCorners corners =
      ending == ".stl" ? ParseStl(bytes, path.string()) : ParseObj(bytes, path.string());
  if (corners.points.empty())
    throw Error("there are no faces in this mesh", path.string(), "Export it again");
  return Weld(corners);
}

}  // namespace

void ComputeVertexNormals(TriangleMesh& mesh) {
  mesh.normals.assign(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d& a = mesh.vertices[t[0]];
    const Eigen::Vector3d twice_area = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
    for (std::uint32_t i : t) mesh.normals[i] += twice_area;
  }
  for (Eigen::Vector3d& n : mesh.normals) {
    const double length = n.norm();
    n = length > 0 ? Eigen::Vector3d(n / length) : Eigen::Vector3d::UnitZ();
  }
}

double TriangleDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c) {
  const Eigen::Vector3d n = (b - a).cross(c - a);
  const double length = n.norm();
  const bool above = length > 0 && (b - a).cross(p - a).dot(n) >= 0 && (c - b).cross(p - b).dot(n) >= 0 &&
                     (a - c).cross(p - c).dot(n) >= 0;
  if (above) return std::abs((p - a).dot(n)) / length;
  return std::min({SegmentDistance(p, a, b), SegmentDistance(p, b, c), SegmentDistance(p, c, a)});
}

TriangleMesh ReadMesh(const std::filesystem::path& path) {
  constexpr double kFarthest = 1e15;  // what rays are cast at in single precision must have a square
  TriangleMesh mesh = ReadAnyMesh(path);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (!(mesh.vertices[v].cwiseAbs().maxCoeff() < kFarthest))
      throw Error(fmt::format("vertex {} of this mesh is too far from 0", v + 1), path.string(),
                  kExportAgain);
  return mesh;
}

void WriteMesh(const std::filesystem::path& path, const TriangleMesh& mesh) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
      mesh.vertices.size(), mesh.triangles.size());
  bytes.reserve(bytes.size() + mesh.vertices.size() * 24 + mesh.triangles.size() * 13);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    AppendVector(bytes, mesh.vertices[i]);
    AppendVector(bytes, mesh.normals.at(i));
  }
  for (const auto& t : mesh.triangles) {
    AppendBytes(bytes, std::uint8_t(3));
    for (std::uint32_t index : t) AppendBytes(bytes, index);
  }
  WriteFileAtomically(path, bytes);
}

}  // namespace polarscan
