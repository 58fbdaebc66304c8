// SPDX-License-Identifier: Apache-2.0
#include "core/mesh.h"

#include <gtest/gtest.h>
#include <unistd.h>

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
  fs::path Write(const std::string& bytes) const {
    std::ofstream(folder_ / "in.ply", std::ios::binary) << bytes;
    return folder_ / "in.ply";
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

TEST_F(Mesh, ScannedModelsOfTheSharedFolderLoad) {
  const fs::path path = fs::path(POLARSCAN_SHARED) / "data/meshes/bunny_full.ply";
  if (!fs::exists(path)) GTEST_SKIP() << "no " << path;
  const TriangleMesh mesh = ReadMesh(path);
  EXPECT_GT(mesh.triangles.size(), 60000u);
  for (const Eigen::Vector3d& n : mesh.normals) ASSERT_NEAR(n.norm(), 1, 1e-9);
}

}  // namespace
}  // namespace polarscan
