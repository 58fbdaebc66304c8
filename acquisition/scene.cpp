// SPDX-License-Identifier: Apache-2.0
#include "acquisition/scene.h"

#include <algorithm>

#include "acquisition/scene_shapes.h"
#include "core/error.h"

namespace polarscan {
namespace {

constexpr int kPrintSize = 2048, kCoarseFactor = 16;
constexpr double kSink = 0.003;  // how deep the object stands in the table, so that no light leaks under it

TriangleMesh MakeObject(const SceneOptions& options) {
  TriangleMesh mesh = options.mesh.empty() ? NamedShape(options.scene) : ReadMesh(options.mesh);
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

}  // namespace

double Scene::PrintAt(const Eigen::Vector3d& p, bool coarse) const {
  const double u = 0.5 + 0.5 * p.x() / table_half_size, v = 0.5 + 0.5 * p.z() / table_half_size;
  return Sample(coarse ? coarse_print : print, u, v);
}

Scene MakeScene(const SceneOptions& options) {
  Scene scene;
  scene.object = MakeObject(options);
  scene.object_material = {options.ior, options.roughness};
  scene.object_texture = MakeTexture(options);
  scene.has_table = options.table;
  double lowest = 1;
  for (const Eigen::Vector3d& v : scene.object.vertices) lowest = std::min(lowest, v.y());
  scene.table_height = lowest + kSink;
  if (options.table) {
    scene.print = MakePrint(kPrintSize, options.seed + 2);
    scene.coarse_print = Shrink(scene.print, kCoarseFactor);
  }
  scene.environment = NamedEnvironment(options.light);
  return scene;
}

TriangleMesh TableMesh(const Scene& scene) {
  const double s = scene.table_half_size, y = scene.table_height;
  TriangleMesh mesh;
  mesh.vertices = {{-s, y, -s}, {-s, y, s}, {s, y, s}, {s, y, -s}};
  mesh.normals.assign(4, Eigen::Vector3d::UnitY());
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

}  // namespace polarscan
