// SPDX-License-Identifier: Apache-2.0
#include "report/scene/mesh.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/files/bytes.h"
#include "core/formats/ply.h"
#include "core/mesh.h"
#include "fusion/mesh_topology.h"
#include "fusion/surface/nearest_points.h"
#include "fusion/surface/simplify.h"

namespace polarscan {
namespace {

using Indices = std::vector<std::uint32_t>;

struct ColouredMesh {
  TriangleMesh mesh;         // display frame
  std::vector<Rgb8> colour;  // of the vertices; empty if the file has none
};

std::vector<Rgb8> ReadColours(const std::filesystem::path& ply) {
  PlyFile file = ReadPly(ply);
  auto& columns = file["vertex"].columns;
  for (const char* name : {"red", "green", "blue"})
    if (!columns.contains(name)) return {};
  const auto byte = [&](const char* name, std::size_t i) {
    return std::uint8_t(std::clamp(columns[name][i], 0., 255.));
  };
  std::vector<Rgb8> colours;
  for (std::size_t i = 0; i < columns["red"].size(); ++i)
    colours.push_back({byte("red", i), byte("green", i), byte("blue", i)});
  return colours;
}

ColouredMesh Read(const std::filesystem::path& ply, const Eigen::Matrix3d& display_from_world) {
  ColouredMesh read{ReadMesh(ply), ReadColours(ply)};
  if (read.mesh.triangles.empty()) throw Error("the mesh has no faces", ply.string());
  for (Eigen::Vector3d& v : read.mesh.vertices) v = display_from_world * v;
  for (Eigen::Vector3d& n : read.mesh.normals) n = display_from_world * n;
  return read;
}

// Where simplification that keeps the topology does not get there, one that does not.
std::vector<Triangle> FewTriangles(const TriangleMesh& mesh, std::size_t max_faces) {
  if (mesh.triangles.size() <= max_faces) return mesh.triangles;
  const std::vector<Triangle> few = CollapsedTriangles(mesh, int(max_faces));
  if (3 * few.size() <= 4 * max_faces) return few;
  std::vector<float> places;
  for (const Eigen::Vector3d& v : mesh.vertices)
    places.insert(places.end(), {float(v.x()), float(v.y()), float(v.z())});
  constexpr float kAnyError = 1;
  Indices fewer(3 * few.size());
  fewer.resize(meshopt_simplifySloppy(fewer.data(), few.front().data(), fewer.size(), places.data(),
                                      mesh.vertices.size(), 3 * sizeof(float), 3 * max_faces, kAnyError,
                                      nullptr));
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i < fewer.size(); i += 3)
    triangles.push_back({fewer[i], fewer[i + 1], fewer[i + 2]});
  return triangles;
}

// The mesh of these triangles and the vertices that they name.
ColouredMesh Compact(const ColouredMesh& from, std::vector<Triangle> triangles) {
  const std::size_t count = triangles.size();
  KeptPart part =
      KeepTriangles({from.mesh.vertices, {}, std::move(triangles)}, std::vector<bool>(count, true));
  ColouredMesh to{std::move(part.mesh), {}};
  for (std::uint32_t v : part.origin) {
    to.mesh.normals.push_back(from.mesh.normals[v]);
    if (!from.colour.empty()) to.colour.push_back(from.colour[v]);
  }
  return to;
}

void PackTriangles(const std::vector<Triangle>& triangles, std::string& bytes) {
  for (const Triangle& t : triangles)
    for (std::uint32_t index : t) AppendBytes(bytes, index);
}

// The cloud's scalar layers, at the vertices.
void PackScalars(const std::vector<Eigen::Vector3d>& vertices, const CloudSample& sample,
                 const ReportCloud& cloud, ReportMesh& mesh) {
  if (sample.empty()) return;
  const auto nearest = NearestPoints(sample.points, vertices, 1);
  for (const nlohmann::json& layer : cloud.facts.at("layers")) {
    const auto scalars = cloud.scalars.find(layer.at("key"));
    if (scalars == cloud.scalars.end()) continue;
    for (const auto& points : nearest) mesh.bytes += scalars->second[points.front().index];
    mesh.facts["layers"].push_back(layer);
  }
}

}  // namespace

ReportMesh PackMesh(const std::filesystem::path& ply, std::size_t max_faces,
                    const Eigen::Matrix3d& display_from_world, const CloudSample& sample,
                    const ReportCloud& cloud) {
  const ColouredMesh read = Read(ply, display_from_world);
  const ColouredMesh shown = Compact(read, FewTriangles(read.mesh, max_faces));
  const std::vector<Triangle>& triangles = shown.mesh.triangles;
  const std::vector<Eigen::Vector3d>& vertices = shown.mesh.vertices;
  if (vertices.empty()) throw Error("the mesh has no faces", ply.string());

  ReportMesh mesh;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& v : vertices) center += v / double(vertices.size());
  double radius = 1e-9;
  for (const Eigen::Vector3d& v : vertices) radius = std::max(radius, (v - center).norm());
  mesh.facts = {{"total", read.mesh.triangles.size()},
                {"shown", triangles.size()},
                {"vertices", vertices.size()},
                {"center", ToArray(center)},
                {"radius", radius},
                {"layers", nlohmann::json::array()}};
  PackTriangles(triangles, mesh.bytes);
  PackPositions(vertices, mesh.facts, mesh.bytes);
  if (!shown.colour.empty()) mesh.facts["layers"].push_back({{"key", "colour"}, {"label", "Colour"}});
  for (const Rgb8& c : shown.colour) mesh.bytes += {char(c.r), char(c.g), char(c.b)};
  mesh.facts["layers"].push_back({{"key", "normal"}, {"label", "Normal"}});
  PackNormals(shown.mesh.normals, mesh.bytes);
  PackScalars(vertices, sample, cloud, mesh);
  return mesh;
}

}  // namespace polarscan
