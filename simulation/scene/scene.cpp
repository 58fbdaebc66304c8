// SPDX-License-Identifier: Apache-2.0
#include "simulation/scene/scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/random.h"
#include "simulation/scene/shapes.h"

namespace polarscan {
namespace {

constexpr int kPrintSize = 2048, kCoarseFactor = 16;
constexpr double kSheetPixelsPerMm = 8;
constexpr float kInk = 0.04f, kPaper = 0.60f;            // reflectance of the board
constexpr double kRoomTile_rad = 0.7, kRoomLight = 0.9;  // a print's width; radiance where it is white
constexpr float kPlainTable = 0.25f;                     // reflectance of a table without a print
constexpr double kDimFloor = 0.03;                       // radiance behind the scene where there is no room
constexpr double kSink = 0.003;  // how deep the object stands in the table, so that no light leaks under it

TriangleMesh MakeObject(const SceneOptions& options, const Progress& progress) {
  TriangleMesh mesh = options.mesh.empty() ? NamedShape(options.scene, progress) : ReadMesh(options.mesh);
  if (!options.mesh.empty() && options.up == "z") {
    const auto turn = [](Eigen::Vector3d& v) { v = Eigen::Vector3d(v.x(), v.z(), -v.y()); };
    std::for_each(mesh.vertices.begin(), mesh.vertices.end(), turn);
    std::for_each(mesh.normals.begin(), mesh.normals.end(), turn);
  }
  Normalize(mesh);
  return mesh;
}

SolidTexture MakeTexture(const SceneOptions& options) {
  SolidTexture texture{options.albedo, 0, false, ValueNoise(options.seed + 1)};
  if (options.texture == "none") return texture;
  texture.patches = options.texture == "weak";
  if (texture.patches) {
    texture.contrast = 0.12 * options.albedo;
  } else if (options.texture == "strong") {
    texture.contrast = 0.6 * options.albedo;
  } else {
    throw Error("no such texture", options.texture, "Try 'none', 'weak' or 'strong'");
  }
  return texture;
}

// One side of a block: a square grid with corners origin, origin + a, origin + b; outward is a x b.
void AddSide(TriangleMesh& mesh, const Eigen::Vector3d& origin, const Eigen::Vector3d& a,
             const Eigen::Vector3d& b) {
  constexpr std::uint32_t kCells = 8, kRow = kCells + 1;
  const auto first = std::uint32_t(mesh.vertices.size());
  for (std::uint32_t i = 0; i < kRow * kRow; ++i) {
    mesh.vertices.push_back(origin + a * (double(i % kRow) / kCells) + b * (double(i / kRow) / kCells));
    mesh.normals.push_back(a.cross(b).normalized());
  }
  for (std::uint32_t i = 0; i < kCells * kCells; ++i) {
    const std::uint32_t corner = first + i / kCells * kRow + i % kCells;
    mesh.triangles.push_back({corner, corner + 1, corner + 1 + kRow});
    mesh.triangles.push_back({corner, corner + 1 + kRow, corner + kRow});
  }
}

// A block with a square base of half width `half` around `center`, without its bottom.
void AddBlock(TriangleMesh& mesh, const Eigen::Vector3d& center, double half, double height, double turn) {
  const Eigen::Vector3d x(std::cos(turn), 0, std::sin(turn)), z(-std::sin(turn), 0, std::cos(turn));
  const Eigen::Vector3d up(0, height, 0);
  AddSide(mesh, center + up - half * x - half * z, 2 * half * z, 2 * half * x);
  for (int side = 0; side < 4; ++side) {
    const double angle = turn + side * std::numbers::pi / 2;
    const Eigen::Vector3d out(std::cos(angle), 0, std::sin(angle)),
        along = out.cross(Eigen::Vector3d::UnitY());
    AddSide(mesh, center + half * out - half * along, up, 2 * half * along);
  }
}

// Blocks in a ring around the object, of all heights, so that a picture shows more than a plane: from a plane
// alone structure from motion cannot tell the focal length. Low enough to hide nothing of the object from a
// camera that looks down by 30 degrees or more.
TriangleMesh MakeBlocks(double table_height, std::uint64_t seed) {
  constexpr int kBlocks = 11;
  TriangleMesh mesh;
  for (int i = 0; i < kBlocks; ++i) {
    Random random(seed, 5, std::uint64_t(i));
    const double turn = 2 * std::numbers::pi * (i + 0.4 * random.Uniform()) / kBlocks;
    const double radius = 1.36 + 0.24 * random.Uniform(), half = 0.09 + 0.07 * random.Uniform();
    const double height = 0.10 + 0.18 * random.Uniform();
    AddBlock(mesh, {radius * std::sin(turn), table_height, radius * std::cos(turn)}, half, height,
             3 * random.Uniform());
  }
  return mesh;
}

Image<float> MakeSheet(const Board& board) {
  Image<float> sheet = BoardPicture(board, kSheetPixelsPerMm);
  for (float& value : sheet.pixels()) value = std::lerp(kInk, kPaper, value);
  return sheet;
}

constexpr double kSheetPixelsPerUnit = kSheetPixelsPerMm * kMmPerUnit;

// Half of the sheet's sides, world units.
Eigen::Vector2d HalfSheet(const Image<float>& sheet) {
  return Eigen::Vector2d(sheet.width(), sheet.height()) / (2 * kSheetPixelsPerUnit);
}

bool IsOnSheet(const Image<float>& sheet, double x, double z) {
  const Eigen::Vector2d half = HalfSheet(sheet);
  return !sheet.empty() && std::abs(x) < half.x() && std::abs(z) < half.y();
}

double SheetAt(const Image<float>& sheet, double x, double z) {
  const Eigen::Vector2d half = HalfSheet(sheet);
  return Sample(sheet, 0.5 + 0.5 * x / half.x(), 0.5 + 0.5 * z / half.y());
}

// The print with the sheet on it, for light on its second way.
Image<float> WithSheet(Image<float> print, const Image<float>& sheet, double half_size) {
  for (int y = 0; y < print.height(); ++y)
    for (int x = 0; x < print.width(); ++x) {
      const double at_x = half_size * (2 * (x + 0.5) / print.width() - 1),
                   at_z = half_size * (2 * (y + 0.5) / print.height() - 1);
      if (IsOnSheet(sheet, at_x, at_z)) print(x, y) = float(SheetAt(sheet, at_x, at_z));
    }
  return print;
}

// A direction of the world as the lamps and the room have it.
Eigen::Vector3d Turned(const Eigen::Vector3d& d, double turn_rad) {
  if (turn_rad == 0) return d;
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  return {c * d.x() - s * d.z(), d.y(), s * d.x() + c * d.z()};
}

}  // namespace

double Scene::LampLight(const Eigen::Vector3d& direction) const {
  return environment.Radiance(Turned(direction, turn_rad));
}

double Scene::RoomLight(const Eigen::Vector3d& direction) const {
  if (room.empty()) return kDimFloor;
  const Eigen::Vector3d d = Turned(direction, turn_rad);
  const double u = std::atan2(d.x(), d.z()) / kRoomTile_rad,
               v = std::asin(std::clamp(d.y(), -1.0, 1.0)) / kRoomTile_rad;
  return kRoomLight * Sample(room, u - std::floor(u), v - std::floor(v));
}

double Scene::PrintAt(const Eigen::Vector3d& p, const Eigen::Vector3d& normal, bool coarse) const {
  constexpr double kOnTable = 1e-6;
  const Image<float>& picture = coarse ? coarse_print : print;
  const bool on_table = normal.y() > 0.9 && p.y() < table_height + kOnTable;
  if (on_table && !coarse && IsOnSheet(sheet, p.x(), p.z())) return SheetAt(sheet, p.x(), p.z());
  if (normal.y() > 0.9)
    return Sample(picture, 0.5 + 0.5 * p.x() / table_half_size, 0.5 + 0.5 * p.z() / table_half_size);
  // The side of a block: a part of the print of its own, found by the side's distance from the middle.
  const double u = 0.5 * (p.x() * normal.z() - p.z() * normal.x()) / table_half_size + 7.3 * p.dot(normal);
  const double v = 0.5 * p.y() / table_half_size + 3.1 * p.dot(normal);
  return Sample(picture, u - std::floor(u), v - std::floor(v));
}

Scene MakeScene(const SceneOptions& options, const Progress& progress) {
  Scene scene;
  scene.object = MakeObject(options, progress);
  progress.Check();
  scene.object_material = {options.ior, options.roughness};
  scene.object_texture = MakeTexture(options);
  scene.has_table = options.table;
  if (options.board && !options.table)
    throw Error("a board lies on a table, and there is none", "--board", "Leave out --no-table");
  double lowest = 1;
  for (const Eigen::Vector3d& v : scene.object.vertices) lowest = std::min(lowest, v.y());
  scene.table_height = lowest + kSink;
  if (options.table) {
    scene.print = options.print ? MakePrint(kPrintSize, options.seed + 2, progress)
                                : Image<float>(kPrintSize, kPrintSize, kPlainTable);
    if (options.board) scene.sheet = MakeSheet(StandardBoards()[0]);
    scene.coarse_print =
        Shrink(options.board ? WithSheet(scene.print, scene.sheet, scene.table_half_size) : scene.print,
               kCoarseFactor);
    if (options.blocks) scene.blocks = MakeBlocks(scene.table_height, options.seed);
    for (const Eigen::Vector3d& v : scene.blocks.vertices) scene.reach = std::max(scene.reach, v.norm());
  }
  scene.environment = NamedEnvironment(options.light);
  if (options.room) scene.room = MakePrint(kPrintSize, options.seed + 3, progress);
  return scene;
}

Similarity BoardFromWorld(const Scene& scene) {
  Similarity board_from_world{kMmPerUnit, Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero()};
  board_from_world.rotation.row(0) = Eigen::RowVector3d::UnitX();
  board_from_world.rotation.row(1) = -Eigen::RowVector3d::UnitZ();
  board_from_world.rotation.row(2) = Eigen::RowVector3d::UnitY();
  board_from_world.translation.z() = -kMmPerUnit * scene.table_height;
  return board_from_world;
}

TriangleMesh TableMesh(const Scene& scene) {
  const double s = scene.table_half_size, y = scene.table_height;
  TriangleMesh mesh = scene.blocks;
  const auto first = std::uint32_t(mesh.vertices.size());
  for (const auto& [x, z] : {std::pair(-s, -s), std::pair(-s, s), std::pair(s, s), std::pair(s, -s)}) {
    mesh.vertices.emplace_back(x, y, z);
    mesh.normals.emplace_back(0, 1, 0);
  }
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
  return mesh;
}

}  // namespace polarscan
