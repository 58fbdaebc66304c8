// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

#include "board/board.h"
#include "core/mesh.h"
#include "core/similarity.h"
#include "simulation/scene/environment.h"
#include "simulation/scene/texture.h"

namespace polarscan {

// A smooth dielectric with a diffusing inside: index of refraction and GGX roughness (0: a mirror) of its
// surface.
struct Material {
  double ior = 1.5, roughness = 0.15;
};

// What the simulated camera looks at. World: y up; the object's bounding sphere is the unit sphere; it stands
// on a square table, a horizontal plane that carries a print.
struct Scene {
  TriangleMesh object;
  Material object_material;
  SolidTexture object_texture;

  bool has_table = true;
  double table_height = -1, table_half_size = 2.3;
  Material table_material{1.5, 0.30};
  TriangleMesh blocks;               // the table's material; may be empty
  double reach = 1;                  // radius around the origin that holds the object and the blocks
  Image<float> print, coarse_print;  // reflectance; coarse: for light that was scattered once already
  Image<float> sheet;                // a board on the print, its middle on the table's; empty: none

  Environment environment{1.0};
  Image<float> room;    // radiance of a wall far away, all around; empty: none
  double turn_rad = 0;  // of lamps and room about y: they stand with a camera before which the scene turns

  // Unpolarized light from far away; `direction` is unit and points away from the scene.
  double LampLight(const Eigen::Vector3d& direction) const;
  // What a camera sees behind the scene.
  double RoomLight(const Eigen::Vector3d& direction) const;

  // Reflectance of the print at a world point on the table or a block, and the surface's normal there.
  double PrintAt(const Eigen::Vector3d& p, const Eigen::Vector3d& normal, bool coarse) const;
};

// The board that lies under the object, the first of StandardBoards(), and how many millimetres a unit is then.
inline constexpr double kMmPerUnit = 60;
// Its frame (Board) from the world's.
Similarity BoardFromWorld(const Scene& scene);

struct SceneOptions {
  std::string scene = "bear";
  std::string mesh;              // PLY file instead of a named scene
  std::string up = "y";          // of that file
  std::string texture = "weak";  // none, weak, strong
  std::string light = "studio";
  double albedo = 0.28, roughness = 0.15, ior = 1.5;
  bool table = true, blocks = true, board = false, room = false, print = true;
  std::uint64_t seed = 0;  // of the textures
};

// Throws Error on an unknown name or an unreadable mesh.
Scene MakeScene(const SceneOptions& options, const Progress& progress = {});

// The table top, facing up, and the blocks.
TriangleMesh TableMesh(const Scene& scene);

}  // namespace polarscan
