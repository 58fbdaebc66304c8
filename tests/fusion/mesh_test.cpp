// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>
#include <sstream>

#include "core/random.h"
#include "fusion/mesh_files.h"
#include "fusion/surface/poisson/close_surface.h"
#include "fusion/surface/poisson/membranes.h"
#include "fusion/surface/poisson/poisson.h"
#include "fusion/surface/simplify.h"
#include "pipeline/meshing.h"
#include "tests/fusion/icosphere.h"
#include "tests/fusion/sphere_scene.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// `count` points spread evenly over the unit sphere, exact normals; those above `highest` z are missing.
std::vector<CloudPoint> SphereCloud(int count, double highest = 2) {
  std::vector<CloudPoint> cloud;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - 2 * (i + 0.5) / count, around = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - z * z);
    const Eigen::Vector3f p(float(r * std::cos(around)), float(r * std::sin(around)), float(z));
    if (z <= highest) cloud.push_back({p, p, SphereColour(p.cast<double>()), 0.25f, 0.75f, 5});
  }
  return cloud;
}

double FarthestFromSphere(const TriangleMesh& mesh) {
  double worst = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) worst = std::max(worst, std::abs(v.norm() - 1));
  return worst;
}

bool IsClosed(const TriangleMesh& mesh) { return BorderLoops(mesh.triangles).empty(); }

SurfaceMesh SmallMesh() {
  SurfaceMesh mesh;
  for (const Eigen::Vector3d& v : Icosphere(1).vertices)
    mesh.vertices.push_back(
        {v.cast<float>() * 2, v.cast<float>(), SphereColour(v), 0.25f, 0.5f, std::uint16_t(7)});
  mesh.triangles = Icosphere(1).triangles;
  return mesh;
}

// A cloud and a workspace without masks or polarization in a folder of its own.
struct MeshScan {
  explicit MeshScan(const std::vector<CloudPoint>& cloud) {
    Workspace workspace = SphereWorkspace(folder.path() / "dense", 3);
    workspace.polarized = false;
    WriteWorkspace(workspace);
    WriteCloud(Cloud(), cloud);
  }
  fs::path Cloud() const { return folder.path() / "cloud.ply"; }
  fs::path Mesh() const { return folder.path() / "mesh.ply"; }
  MeshSummary Make(const MeshOptions& options = {}) {
    Progress progress;
    return MakeMesh(Cloud(), folder.path() / "dense", Mesh(), options, progress);
  }
  std::string WhatMakeThrows(const MeshOptions& options = {}) {
    try {
      Make(options);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  TemporaryFolder folder;
};

TEST(Topology, AnIcosphereIsClosedAndEverythingHasSixNeighboursButTheCorners) {
  const TriangleMesh sphere = Icosphere(3);
  EXPECT_TRUE(IsClosed(sphere));
  const VertexNeighbours neighbours(sphere.vertices.size(), sphere.triangles);
  for (std::size_t v = 0; v < sphere.vertices.size(); ++v) {
    EXPECT_EQ(neighbours.Of(v).size(), v < 6 ? 4u : 6u);
    ASSERT_EQ(neighbours.TrianglesOf(v).size(), v < 6 ? 4u : 6u);
    EXPECT_TRUE(std::ranges::is_sorted(neighbours.TrianglesOf(v)));
    for (std::uint32_t t : neighbours.TrianglesOf(v))
      EXPECT_EQ(std::ranges::count(sphere.triangles[t], std::uint32_t(v)), 1);
  }
}

TEST(Topology, AMissingTriangleLeavesALoopThatFillsIt) {
  TriangleMesh sphere = Icosphere(2);
  const Triangle gone = sphere.triangles[10];
  sphere.triangles.erase(sphere.triangles.begin() + 10);
  auto loops = BorderLoops(sphere.triangles);
  ASSERT_EQ(loops.size(), 1u);
  ASSERT_EQ(loops[0].size(), 3u);
  sphere.triangles.push_back({loops[0][0], loops[0][1], loops[0][2]});
  EXPECT_TRUE(IsClosed(sphere));
  Triangle filled = sphere.triangles.back();
  std::rotate(filled.begin(), std::find(filled.begin(), filled.end(), gone[0]), filled.end());
  EXPECT_EQ(filled, gone) << "the other way round";
}

// A harmonic function takes its extremes on the rim.
TEST(Closing, AFarCapBecomesAMembraneBetweenTheHighestAndLowestOfItsRim) {
  const TriangleMesh sphere = Icosphere(5);
  std::vector<bool> far;
  double highest_near = -1;
  for (const Eigen::Vector3d& v : sphere.vertices) {
    far.push_back(v.z() > 0.8);
    if (!far.back()) highest_near = std::max(highest_near, v.z());
  }
  ClosingCounts counts;
  Progress silent;
  const TriangleMesh closed = CloseSurface(sphere, far, {}, counts, silent);
  EXPECT_TRUE(IsClosed(closed));
  EXPECT_EQ(counts.closed, 1);
  EXPECT_EQ(counts.cut, 0);
  ASSERT_EQ(closed.vertices.size(), far.size());
  for (std::size_t v = 0; v < far.size(); ++v) {
    EXPECT_LE(closed.vertices[v].z(), highest_near + 1e-6);
    EXPECT_TRUE(!far[v] || closed.vertices[v].z() > 0.74);
  }
  // The disc of radius 0.6 over the surface of the sphere below z = 0.8.
  EXPECT_NEAR(counts.closed_area, 0.36 / (0.36 + 2 * 1.8), 0.01);
}

TEST(Closing, AGapLargerThanAskedForIsCutAndLeavesABorder) {
  const TriangleMesh sphere = Icosphere(4);
  std::vector<bool> far;
  for (const Eigen::Vector3d& v : sphere.vertices) far.push_back(v.z() > 0);
  ClosingCounts counts;
  Progress silent;
  const TriangleMesh half = CloseSurface(sphere, far, {}, counts, silent);
  EXPECT_EQ(counts.cut, 1);
  EXPECT_EQ(BorderLoops(half.triangles).size(), 1u);
  for (const Eigen::Vector3d& v : half.vertices) EXPECT_LE(v.z(), 1e-9);
}

// A square of side * side vertices; all but those of its rim are free and far from their places.
struct Square {
  TriangleMesh mesh;
  std::vector<bool> free;
};

Square LooseSquare(std::uint32_t side) {
  Square square;
  for (std::uint32_t y = 0; y < side; ++y)
    for (std::uint32_t x = 0; x < side; ++x) {
      const bool rim = x == 0 || y == 0 || x + 1 == side || y + 1 == side;
      square.mesh.vertices.emplace_back(x, y, rim ? 0.5 * x - 0.25 * y : 100 * std::sin(0.01 * x));
      square.free.push_back(!rim);
      if (x == 0 || y == 0) continue;
      const std::uint32_t i = y * side + x;
      square.mesh.triangles.push_back({i - side - 1, i - side, i - 1});
      square.mesh.triangles.push_back({i - side, i, i - 1});
    }
  return square;
}

TEST(Membranes, ALargeOneOverAPlaneRimIsThatPlane) {
  Square square = LooseSquare(700);
  Progress silent;
  StretchMembranes(square.mesh, square.free, silent);
  double worst = 0;
  for (const Eigen::Vector3d& v : square.mesh.vertices)
    worst = std::max(worst, std::abs(v.z() - (0.5 * v.x() - 0.25 * v.y())));
  EXPECT_LT(worst, 1e-3);
}

// A sum of the numbers of its neighbours exceeds 2^31, which a minimum-degree ordering did not survive.
TEST(Membranes, AVertexInTheMiddleOfAHugeHoleAmongAMillionIsTheMeanOfItsNeighbours) {
  Square square = LooseSquare(1050);
  const auto middle = std::uint32_t(square.mesh.vertices.size());
  square.mesh.vertices.emplace_back(0, 0, 1000);
  square.free.push_back(true);
  for (std::uint32_t i = middle - 9000; i < middle - 2000; ++i)
    square.mesh.triangles.push_back({i, i + 1, middle});
  Progress silent;
  StretchMembranes(square.mesh, square.free, silent);
  const VertexNeighbours neighbours(square.mesh.vertices.size(), square.mesh.triangles);
  double worst = 0;
  for (std::size_t v = 0; v < square.free.size(); ++v) {
    if (!square.free[v]) continue;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::uint32_t other : neighbours.Of(v)) sum += square.mesh.vertices[other];
    worst = std::max(worst, (sum / double(neighbours.Of(v).size()) - square.mesh.vertices[v]).norm());
  }
  EXPECT_LT(worst, 1e-3);
}

TEST(Membranes, StretchingThemCanBeCancelled) {
  struct Impatient : Progress {
    void Advance(std::size_t) override { Cancel(); }
  } progress;
  Square square = LooseSquare(100);
  EXPECT_THROW(StretchMembranes(square.mesh, square.free, progress), Cancelled);
}

TEST(Closing, SmallPiecesAndPiecesWithoutPointsGo) {
  TriangleMesh mesh = Icosphere(4);
  std::vector<bool> far(mesh.vertices.size(), false);
  const TriangleMesh piece = Icosphere(1);
  for (const auto& [size, is_far] : {std::pair{0.05, false}, {2.0, true}, {0.5, false}}) {
    const auto first = std::uint32_t(mesh.vertices.size());
    for (const Eigen::Vector3d& v : piece.vertices) {
      mesh.vertices.emplace_back(size * v + Eigen::Vector3d(5 * double(first), 0, 0));
      far.push_back(is_far);
    }
    for (const Triangle& t : piece.triangles)
      mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  ClosingCounts counts;
  Progress silent;
  const TriangleMesh kept = CloseSurface(mesh, far, {}, counts, silent);
  EXPECT_EQ(counts.pieces, 2);
  EXPECT_EQ(FindPieces(kept.vertices.size(), kept.triangles).count, 2);
}

TEST(Simplification, AClosedSphereStaysClosedAndRound) {
  const TriangleMesh simple = Simplify(Icosphere(5), 1000);
  EXPECT_LE(simple.triangles.size(), 1000u);
  EXPECT_GT(simple.triangles.size(), 900u);
  EXPECT_TRUE(IsClosed(simple));
  EXPECT_LT(FarthestFromSphere(simple), 1e-6) << "its vertices are some of the old ones";
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

TEST(Meshing, APoissonDepthHoldsTwoPointsACell) {
  const std::vector<CloudPoint> cloud = SphereCloud(20000);
  const int depth = PoissonDepth(cloud);
  const double cell = PoissonCell(cloud, depth);
  EXPECT_NEAR(cell, 2.2 / std::pow(2, depth), 1e-3);
  // A sphere crosses about 1.5 times as many cells as fit its area.
  const double cells = 1.5 * 4 * std::numbers::pi / (cell * cell);
  EXPECT_GT(20000 / cells, 1.8);
  EXPECT_LT(20000 / cells, 9);
}

TEST(Meshing, ASphereCloudGivesAClosedMeshWithinAThirteenthOfACell) {
  MeshScan scan(SphereCloud(5000));
  const MeshSummary summary = scan.Make();
  const TriangleMesh mesh = ReadMesh(scan.Mesh());
  EXPECT_TRUE(summary.closed);
  EXPECT_TRUE(IsClosed(mesh));
  EXPECT_EQ(mesh.triangles.size(), summary.faces);
  EXPECT_EQ(2 * mesh.vertices.size(), 4 + mesh.triangles.size()) << "Euler's formula for a sphere";
  EXPECT_LT(FarthestFromSphere(mesh), summary.cell / 13);
  for (const CloudPoint& v : ReadSurfaceMesh(scan.Mesh()).vertices) {
    const Eigen::Vector3d n = v.position.cast<double>().normalized();
    EXPECT_GT(v.normal.cast<double>().dot(n), std::cos(summary.cell));
    EXPECT_NEAR(v.colour.r, SphereColour(n).r, 12);
    EXPECT_NEAR(v.confidence, 0.75, 1e-5);
  }
}

TEST(Meshing, AHoleIsClosedByAFlatMembraneWithoutConfidence) {
  MeshScan scan(SphereCloud(5000, 0.8));
  const MeshSummary summary = scan.Make();
  EXPECT_TRUE(summary.closed);
  EXPECT_EQ(summary.gaps_closed, 1);
  std::size_t unseen = 0;
  for (const CloudPoint& v : ReadSurfaceMesh(scan.Mesh()).vertices) {
    EXPECT_LT(v.position.z(), 0.8 + 2 * summary.cell);
    if (v.position.head<2>().norm() < 0.4 && v.position.z() > 0) {
      EXPECT_EQ(v.confidence, 0);
      ++unseen;
    }
  }
  EXPECT_GT(unseen, 10u);
}

TEST(Meshing, HalfASphereIsCutAtItsRimUnlessAskedToBeWatertight) {
  MeshScan scan(SphereCloud(5000, 0));
  MeshSummary summary = scan.Make();
  EXPECT_FALSE(summary.closed);
  for (const Eigen::Vector3d& v : ReadMesh(scan.Mesh()).vertices) EXPECT_LT(v.z(), 2 * summary.cell);
  MeshOptions options;
  options.close = 1000;
  summary = scan.Make(options);
  EXPECT_TRUE(summary.closed);
}

TEST(Meshing, FacesLimitsTheTrianglesOfAClosedMesh) {
  MeshScan scan(SphereCloud(5000));
  MeshOptions options;
  options.faces = 800;
  const MeshSummary summary = scan.Make(options);
  EXPECT_LE(summary.faces, 800u);
  EXPECT_TRUE(summary.closed);
}

TEST(Meshing, TwoRunsAndTwoThreadsGiveTheSameBytes) {
  MeshScan scan(SphereCloud(5000, 0.9));
  scan.Make();
  const std::string first = ReadFile(scan.Mesh());
  for (std::size_t threads : {1, 2}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    scan.Make();
    EXPECT_TRUE(ReadFile(scan.Mesh()) == first) << threads << " threads";
  }
}

TEST(Meshing, WhatCannotBecomeAMeshIsSaidWithWhatToDo) {
  EXPECT_NE(MeshScan(SphereCloud(50)).WhatMakeThrows().find("50 of 50 points"), std::string::npos);

  MeshScan unsure(SphereCloud(1000));
  MeshOptions options;
  options.min_confidence = 0.9;
  EXPECT_NE(unsure.WhatMakeThrows(options).find("--mesh-min-confidence"), std::string::npos);

  options = {};
  options.depth = 3;
  EXPECT_NE(MeshScan(SphereCloud(1000)).WhatMakeThrows(options).find("--mesh-depth 3"), std::string::npos);

  MeshScan gone(SphereCloud(1000));
  fs::remove(gone.Cloud());
  EXPECT_NE(gone.WhatMakeThrows().find("polarscan fuse"), std::string::npos);

  MeshScan bare(SphereCloud(1000));
  WriteFileAtomically(bare.Cloud(),
                      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                      "property float z\nend_header\n0 0 0\n");
  EXPECT_NE(bare.WhatMakeThrows().find("no nx"), std::string::npos);
}

}  // namespace
}  // namespace polarscan
