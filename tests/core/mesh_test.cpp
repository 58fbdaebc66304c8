// SPDX-License-Identifier: Apache-2.0
#include "core/mesh.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>

#include "core/error.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

class Mesh : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("polarscan-mesh-" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path Write(const std::string& bytes, const std::string& name = "in.ply") const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  fs::path folder_;
};

std::string Ascii(const std::string& faces, const std::string& corner = "1 1 0") {
  return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
         "element face " +
         std::to_string(std::count(faces.begin(), faces.end(), '\n')) +
         "\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n" + corner + "\n0 1 0\n" +
         faces;
}

TEST_F(Mesh, APolygonBecomesAFanThatKeepsItsSide) {
  const TriangleMesh mesh = ReadMesh(Write(Ascii("4 0 1 2 3\n")));
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.triangles[0], (std::array<std::uint32_t, 3>{0, 1, 2}));
  EXPECT_EQ(mesh.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
  for (const Eigen::Vector3d& n : mesh.normals) EXPECT_NEAR((n - Eigen::Vector3d::UnitZ()).norm(), 0, 1e-15);
}

TEST_F(Mesh, WrittenMeshesComeBackWithinFloatPrecision) {
  TriangleMesh mesh = ReadMesh(Write(Ascii("3 0 1 2\n3 0 2 3\n", "0.123456789 1.1 0.3")));
  WriteMesh(folder_ / "out.ply", mesh);
  const TriangleMesh again = ReadMesh(folder_ / "out.ply");
  EXPECT_EQ(again.triangles, mesh.triangles);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LT((again.vertices[i] - mesh.vertices[i]).norm(), 1e-7);
    EXPECT_LT((again.normals[i] - mesh.normals[i]).norm(), 1e-6);
  }
}

TEST_F(Mesh, FacesThatNameMissingVerticesAreRefused) {
  EXPECT_THROW(ReadMesh(Write(Ascii("3 0 1 4\n"))), Error);
  EXPECT_THROW(ReadMesh(Write(Ascii("3 0 1 -1\n"))), Error);
  EXPECT_THROW(ReadMesh(Write(Ascii(""))), Error);
  EXPECT_THROW(ReadMesh(Write(Ascii("3 0 1 2\n", "nan 1 0"))), Error);
  EXPECT_THROW(ReadMesh(folder_ / "missing.ply"), Error);
}

using Corners = std::vector<std::array<Eigen::Vector3d, 3>>;

// The sides of the cube [0, 1]^3, outward.
Corners Cube() {
  Corners triangles;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const auto corner = [&](int u, int v) {
        Eigen::Vector3d p;
        p[axis] = side, p[(axis + 1) % 3] = side ? u : v, p[(axis + 2) % 3] = side ? v : u;
        return p;
      };
      triangles.push_back({corner(0, 0), corner(1, 0), corner(1, 1)});
      triangles.push_back({corner(0, 0), corner(1, 1), corner(0, 1)});
    }
  return triangles;
}

// With normals that are all wrong: readers must go by the corners.
std::string BinaryStl(const Corners& triangles, std::string header = "solid by a CAD program") {
  header.resize(80);
  const auto append = [&header](auto value) {
    header.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  append(std::uint32_t(triangles.size()));
  for (const auto& triangle : triangles) {
    append(1.0f), append(2.0f), append(3.0f);
    for (const Eigen::Vector3d& p : triangle)
      for (int k = 0; k < 3; ++k) append(float(p[k]));
    append(std::uint16_t(7));
  }
  return header;
}

std::string AsciiStl(const Corners& triangles) {
  std::string text = "solid my facet of a vertex\r\n";
  for (const auto& triangle : triangles) {
    text += " facet normal 0 0 0\r\n  outer loop\r\n";
    for (const Eigen::Vector3d& p : triangle)
      text += "   vertex " + std::to_string(p.x()) + "\t+" + std::to_string(p.y()) + " " +
              std::to_string(p.z()) + "\r\n";
    text += "  endloop\r\n endfacet\r\n";
  }
  return text + "endsolid my facet of a vertex\r\n";
}

// Every corner has the normal of its side, outward, and each side its own four vertices.
void ExpectCube(const TriangleMesh& mesh) {
  ASSERT_EQ(mesh.triangles.size(), 12u);
  EXPECT_EQ(mesh.vertices.size(), 24u);
  for (const auto& triangle : mesh.triangles) {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (const std::uint32_t i : triangle) center += mesh.vertices[i] / 3;
    Eigen::Index axis = 0;
    (center.array() - 0.5).abs().maxCoeff(&axis);
    const Eigen::Vector3d outward = Eigen::Vector3d::Unit(axis) * (center[axis] > 0.5 ? 1 : -1);
    for (const std::uint32_t i : triangle) EXPECT_LT((mesh.normals[i] - outward).norm(), 1e-12);
  }
}

TEST_F(Mesh, StlOfBothKindsComesWithItsEdges) {
  ExpectCube(ReadMesh(Write(BinaryStl(Cube()), "in.stl")));
  ExpectCube(ReadMesh(Write(AsciiStl(Cube()), "in.STL")));
  std::string shouted = AsciiStl(Cube());
  std::ranges::transform(shouted, shouted.begin(), [](unsigned char c) { return char(std::toupper(c)); });
  ExpectCube(ReadMesh(Write(shouted, "in.stl")));
}

TEST_F(Mesh, ObjComesWithPolygonsNegativeIndicesAndNormals) {
  std::string text = "# a cube\nmtllib none.mtl\no cube\n";
  for (int i = 0; i < 8; ++i)
    text += "v " + std::to_string(i & 1) + " " + std::to_string(i >> 1 & 1) + " " + std::to_string(i >> 2) +
            " 0.5 0.5 0.5\nvt 0 0\n";
  ExpectCube(ReadMesh(Write(text + "f 1/1 3/3 4/4 2/2\nf 5 6 8 7\nf 1 2 6 5\nf -6 -2 -1 \\\n -5 # back\r\n"
                                   "f 1 5 7 3\nf -7/ -5/ -1/ -3/\n",
                            "in.obj")));
  const TriangleMesh smooth = ReadMesh(Write(
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvn 0 0.6 0.8\nvn 0 0 2\nf 1//1 2/9/1 3//-1\nf 2//1 4//2 3//2\n",
      "in.obj"));
  ASSERT_EQ(smooth.triangles.size(), 2u);
  EXPECT_EQ(smooth.vertices.size(), 4u);
  EXPECT_LT((smooth.normals[smooth.triangles[0][0]] - Eigen::Vector3d(0, 0.6, 0.8)).norm(), 1e-12);
  EXPECT_LT((smooth.normals[smooth.triangles[0][2]] - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
}

TEST_F(Mesh, DamagedStlAndObjAreRefusedInWords) {
  const std::string binary = BinaryStl(Cube(), "binary"), ascii = AsciiStl(Cube());
  for (std::size_t size = 0; size < binary.size(); size += 7)
    EXPECT_THROW(ReadMesh(Write(binary.substr(0, size), "in.stl")), Error) << size;
  for (std::size_t size = 0; size + 40 < ascii.size(); size += 13)
    EXPECT_THROW(ReadMesh(Write(ascii.substr(0, size), "in.stl")), Error) << size;
  std::string promises = binary;
  promises.replace(80, 4, "\xff\xff\xff\xff");
  EXPECT_THROW(ReadMesh(Write(promises, "in.stl")), Error);
  Corners nan = Cube();
  nan[3][1].y() = std::nan("");
  EXPECT_THROW(ReadMesh(Write(BinaryStl(nan), "in.stl")), Error);
  EXPECT_THROW(ReadMesh(Write(AsciiStl(nan), "in.stl")), Error);
  for (const char* face : {"f 1 2 4", "f 1 2 0", "f -4 1 2", "f 1 2", "f 1 2 x", "f 1 2 3/1/9", "v 1 2",
                           "v 1 2 inf", "v 1 2 3,5\nf 1 2 3", "f 1 2 99999999999999999999", ""}) {
    try {
      ReadMesh(Write(std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\n") + face + "\n", "in.obj"));
      ADD_FAILURE() << face;
    } catch (const Error& error) {
      const std::string what = error.what();
      EXPECT_TRUE(what.find("line 4") != what.npos || !*face) << what;
      EXPECT_NE(what.find("in.obj"), what.npos) << what;
    }
  }
}

TEST_F(Mesh, ScannedModelsOfTheSharedFolderLoad) {
  const fs::path path = fs::path(POLARSCAN_SHARED) / "data/meshes/bunny_full.ply";
  if (!fs::exists(path)) GTEST_SKIP() << "no " << path;
  const TriangleMesh mesh = ReadMesh(path);
  EXPECT_GT(mesh.triangles.size(), 60000u);
  for (const Eigen::Vector3d& n : mesh.normals) ASSERT_NEAR(n.norm(), 1, 1e-9);
}

}  // namespace
}  // namespace polarscan
