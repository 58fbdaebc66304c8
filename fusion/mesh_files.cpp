// SPDX-License-Identifier: Apache-2.0
#include "fusion/mesh_files.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/files/bytes.h"
#include "core/files/files.h"
#include "core/formats/ply.h"
#include "core/words.h"

namespace polarscan {
namespace {

using nlohmann::json;

std::string Ply(const SurfaceMesh& mesh) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\n{}element vertex {}\n{}element face {}\n"
      "property list uchar uint vertex_indices\nend_header\n",
      PlyOffsetLine(mesh.offset), mesh.vertices.size(), PointProperties(), mesh.triangles.size());
  for (const CloudPoint& v : mesh.vertices) AppendPoint(bytes, v);
  for (const Triangle& t : mesh.triangles) {
    AppendBytes(bytes, std::uint8_t(3));
    for (std::uint32_t index : t) AppendBytes(bytes, index);
  }
  return bytes;
}

std::string Obj(const SurfaceMesh& mesh) {
  std::string text = "# polarscan\n";
  auto out = std::back_inserter(text);
  if (!mesh.offset.isZero(0))
    fmt::format_to(out, "# offset {} {} {}\n", mesh.offset.x(), mesh.offset.y(), mesh.offset.z());
  for (const CloudPoint& v : mesh.vertices)
    fmt::format_to(out, "v {} {} {} {:.4f} {:.4f} {:.4f}\n", v.position.x(), v.position.y(), v.position.z(),
                   v.colour.r / 255.0, v.colour.g / 255.0, v.colour.b / 255.0);
  for (const CloudPoint& v : mesh.vertices)
    fmt::format_to(out, "vn {:.4f} {:.4f} {:.4f}\n", v.normal.x(), v.normal.y(), v.normal.z());
  for (const Triangle& t : mesh.triangles)
    fmt::format_to(out, "f {0}//{0} {1}//{1} {2}//{2}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

// Of one channel: pictures are encoded with sRGB's curve, glTF's COLOR_0 is linear.
std::uint16_t LinearColour(std::uint8_t value) {
  const double c = value / 255.0;
  return std::uint16_t(std::lround(65535 * (c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4))));
}

// The glTF's document; the buffer holds positions, normals, colours and indices one after the other.
json GltfDocument(const SurfaceMesh& mesh) {
  const std::size_t count = mesh.vertices.size(), indices = 3 * mesh.triangles.size();
  Eigen::AlignedBox3f box;
  for (const CloudPoint& v : mesh.vertices) box.extend(v.position);
  constexpr int kFloat = 5126, kUnsignedShort = 5123, kUnsignedInt = 5125, kVertices = 34962,
                kIndices = 34963;
  json views = json::array();
  std::size_t offset = 0;
  for (const auto& [bytes, target] : {std::pair{12 * count, kVertices},
                                      {12 * count, kVertices},
                                      {8 * count, kVertices},
                                      {4 * indices, kIndices}}) {
    views.push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes}, {"target", target}});
    offset += bytes;
  }
  const auto list = [](const Eigen::Vector3f& v) { return json{v.x(), v.y(), v.z()}; };
  const json accessors = {
      {{"bufferView", 0},
       {"componentType", kFloat},
       {"count", count},
       {"type", "VEC3"},
       {"min", list(box.min())},
       {"max", list(box.max())}},
      {{"bufferView", 1}, {"componentType", kFloat}, {"count", count}, {"type", "VEC3"}},
      {{"bufferView", 2},
       {"componentType", kUnsignedShort},
       {"normalized", true},
       {"count", count},
       {"type", "VEC4"}},
      {{"bufferView", 3}, {"componentType", kUnsignedInt}, {"count", indices}, {"type", "SCALAR"}}};
  const json primitive = {{"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"COLOR_0", 2}}}, {"indices", 3}};
  json node = {{"mesh", 0}};
  if (!mesh.offset.isZero(0))
    node["extras"] = {{"offset", {mesh.offset.x(), mesh.offset.y(), mesh.offset.z()}}};
  return {{"asset", {{"version", "2.0"}, {"generator", "polarscan"}}},
          {"scene", 0},
          {"scenes", json::array({{{"nodes", {0}}}})},
          {"nodes", json::array({node})},
          {"meshes", json::array({{{"primitives", json::array({primitive})}}})},
          {"buffers", json::array({{{"byteLength", offset}}})},
          {"bufferViews", views},
          {"accessors", accessors}};
}

std::string Glb(const SurfaceMesh& mesh) {
  std::string text = GltfDocument(mesh).dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string buffer;
  for (const CloudPoint& v : mesh.vertices)
    for (int k = 0; k < 3; ++k) AppendBytes(buffer, v.position[k]);
  for (const CloudPoint& v : mesh.vertices)
    for (int k = 0; k < 3; ++k) AppendBytes(buffer, v.normal[k]);
  for (const CloudPoint& v : mesh.vertices) {
    for (std::uint8_t c : {v.colour.r, v.colour.g, v.colour.b}) AppendBytes(buffer, LinearColour(c));
    AppendBytes(buffer, std::uint16_t(65535));
  }
  for (const Triangle& t : mesh.triangles)
    for (std::uint32_t index : t) AppendBytes(buffer, index);
  std::string file;
  const auto word = [&](std::size_t value) { AppendBytes(file, std::uint32_t(value)); };
  file += "glTF", word(2), word(12 + 8 + text.size() + 8 + buffer.size());
  word(text.size()), file += "JSON" + text;
  word(buffer.size()), file.append("BIN\0", 4), file += buffer;
  return file;
}

std::string Stl(const SurfaceMesh& mesh) {
  std::string bytes = "polarscan; lengths in the unit of the scan's poses";
  bytes.resize(80);
  AppendBytes(bytes, std::uint32_t(mesh.triangles.size()));
  const auto append = [&](const Eigen::Vector3f& v) {
    for (int k = 0; k < 3; ++k) AppendBytes(bytes, v[k]);
  };
  for (const Triangle& t : mesh.triangles) {
    const Eigen::Vector3f &a = mesh.vertices[t[0]].position, &b = mesh.vertices[t[1]].position,
                          &c = mesh.vertices[t[2]].position;
    append((b - a).cross(c - a).normalized());
    append(a), append(b), append(c);
    AppendBytes(bytes, std::uint16_t(0));
  }
  return bytes;
}

}  // namespace

void CheckMeshFileName(const std::filesystem::path& path) {
  const std::string ending = LowerExtension(path);
  if (ending != ".ply" && ending != ".obj" && ending != ".glb" && ending != ".stl")
    throw Error("there is no mesh format for this name", path.string(), "Use .ply, .obj, .glb or .stl");
}

void WriteMeshFile(const std::filesystem::path& path, const SurfaceMesh& mesh) {
  CheckMeshFileName(path);
  const std::string ending = LowerExtension(path);
  WriteFileAtomically(path, ending == ".ply"   ? Ply(mesh)
                            : ending == ".obj" ? Obj(mesh)
                            : ending == ".stl" ? Stl(mesh)
                                               : Glb(mesh));
}

bool IsMeshFile(const std::filesystem::path& path) {
  return CarriesMark(path, PointProperties() + "element face") ||  // a cloud has no faces
         (!CarriesMark(path, "end_header") && CarriesMark(path, "polarscan"));
}

SurfaceMesh ReadSurfaceMesh(const std::filesystem::path& path) {
  SurfaceMesh mesh{ReadCloud(path), ReadMesh(path).triangles, ReadPlyOffset(path)};
  for (const Triangle& t : mesh.triangles)
    for (std::uint32_t index : t)
      if (index >= mesh.vertices.size())
        throw Error("a vertex of the mesh has no normal", path.string(), "Run polarscan mesh again");
  return mesh;
}

}  // namespace polarscan
