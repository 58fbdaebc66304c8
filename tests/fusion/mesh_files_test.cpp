// SPDX-License-Identifier: Apache-2.0
#include "fusion/mesh_files.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <sstream>

#include "tests/fusion/icosphere.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

SurfaceMesh SmallMesh() {
  SurfaceMesh mesh;
  for (const Eigen::Vector3d& v : Icosphere(1).vertices)
    mesh.vertices.push_back(
        {v.cast<float>() * 2, v.cast<float>(), SphereColour(v), 0.25f, 0.5f, std::uint16_t(7)});
  mesh.triangles = Icosphere(1).triangles;
  return mesh;
}

TEST(MeshFiles, PlyReadsBackWithAllPropertiesOfItsVertices) {
  TemporaryFolder folder;
  const SurfaceMesh mesh = SmallMesh();
  WriteMeshFile(folder.path() / "m.ply", mesh);
  const SurfaceMesh back = ReadSurfaceMesh(folder.path() / "m.ply");
  EXPECT_EQ(back.triangles, mesh.triangles);
  ASSERT_EQ(back.vertices.size(), mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    EXPECT_EQ(back.vertices[i].position, mesh.vertices[i].position);
    EXPECT_EQ(back.vertices[i].colour, mesh.vertices[i].colour);
    EXPECT_EQ(back.vertices[i].confidence, 0.5f);
    EXPECT_EQ(back.vertices[i].views, 7);
  }
}

TEST(MeshFiles, ObjHoldsTheSameNumbersAsText) {
  TemporaryFolder folder;
  const SurfaceMesh mesh = SmallMesh();
  WriteMeshFile(folder.path() / "m.obj", mesh);
  std::istringstream text(ReadFile(folder.path() / "m.obj"));
  std::size_t vertices = 0, faces = 0;
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      Eigen::Vector3f p, colour;
      words >> p.x() >> p.y() >> p.z() >> colour.x() >> colour.y() >> colour.z();
      EXPECT_EQ(p, mesh.vertices[vertices].position);
      EXPECT_NEAR(colour.y() * 255, mesh.vertices[vertices].colour.g, 0.02);
      ++vertices;
    } else if (kind == "f") {
      for (std::uint32_t index : mesh.triangles[faces]) {
        std::string corner;
        words >> corner;
        EXPECT_EQ(corner, fmt::format("{0}//{0}", index + 1));
      }
      ++faces;
    }
  }
  EXPECT_EQ(vertices, mesh.vertices.size());
  EXPECT_EQ(faces, mesh.triangles.size());
}

TEST(MeshFiles, GlbHoldsWhatItsDocumentSays) {
  TemporaryFolder folder;
  const SurfaceMesh mesh = SmallMesh();
  WriteMeshFile(folder.path() / "m.glb", mesh);
  const std::string bytes = ReadFile(folder.path() / "m.glb");
  const auto word = [&](std::size_t at) {
    std::uint32_t value;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  };
  ASSERT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word(4), 2u);
  EXPECT_EQ(word(8), bytes.size());
  const std::size_t length = word(12), start = 20 + length + 8;
  ASSERT_EQ(bytes.substr(16, 4), "JSON");
  const auto document = nlohmann::json::parse(bytes.substr(20, length));
  EXPECT_EQ(word(20 + length), document["buffers"][0]["byteLength"]);
  EXPECT_EQ(start + word(20 + length), bytes.size());
  const auto accessor = [&](const nlohmann::json& index) {
    const auto& a = document["accessors"][index.get<std::size_t>()];
    return start +
           document["bufferViews"][a["bufferView"].get<std::size_t>()]["byteOffset"].get<std::size_t>();
  };
  const auto& primitive = document["meshes"][0]["primitives"][0];
  const std::size_t positions = accessor(primitive["attributes"]["POSITION"]),
                    colours = accessor(primitive["attributes"]["COLOR_0"]),
                    indices = accessor(primitive["indices"]);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    Eigen::Vector3f p;
    std::memcpy(p.data(), bytes.data() + positions + 12 * i, 12);
    EXPECT_EQ(p, mesh.vertices[i].position);
    std::uint16_t red;
    std::memcpy(&red, bytes.data() + colours + 8 * i, 2);
    // sRGB's decoding is close to a power of 2.2.
    EXPECT_NEAR(red / 65535.0, std::pow(mesh.vertices[i].colour.r / 255.0, 2.2), 0.01);
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(word(indices + 12 * i + 4 * k), mesh.triangles[i][k]);
}

TEST(MeshFiles, StlReadsBackAsTheSameTrianglesInOrder) {
  TemporaryFolder folder;
  const SurfaceMesh mesh = SmallMesh();
  WriteMeshFile(folder.path() / "m.STL", mesh);
  EXPECT_EQ(fs::file_size(folder.path() / "m.STL"), 84 + 50 * mesh.triangles.size());
  const TriangleMesh back = ReadMesh(folder.path() / "m.STL");
  ASSERT_EQ(back.triangles.size(), mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(back.vertices[back.triangles[i][k]].cast<float>(),
                mesh.vertices[mesh.triangles[i][k]].position);
}

TEST(MeshFiles, AnotherEndingIsRefusedWithThoseThatExist) {
  try {
    CheckMeshFileName("mesh.3ds");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(".ply, .obj, .glb or .stl"), std::string::npos);
  }
}

}  // namespace
}  // namespace polarscan
