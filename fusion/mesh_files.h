// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <vector>

#include "fusion/cloud/cloud.h"
#include "fusion/mesh_topology.h"

namespace polarscan {

// A mesh as the user gets it: vertices with all that the cloud's points have (confidence and views 0 where
// nothing was seen), and triangles that are outward by the right-hand rule. World frame and units.
struct SurfaceMesh {
  std::vector<CloudPoint> vertices;
  std::vector<Triangle> triangles;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // added to coordinates: the world's
};

// Writes the format that the file's name asks for; atomic. An offset is said in a comment (.glb: in the
// node's extras).
//   .ply  binary little-endian; the cloud's properties (fusion/cloud/cloud.h) and the faces
//   .obj  text; colours behind the coordinates, 0 to 1, as MeshLab and Blender read them
//   .glb  binary glTF 2.0: one mesh with normals and linear colours (COLOR_0); axes and units are the world's
//   .stl  binary; no colours and no unit: lengths are the world's
// Throws Error on any other name.
void WriteMeshFile(const std::filesystem::path& path, const SurfaceMesh& mesh);

// Throws Error if WriteMeshFile knows no format for the name: before the work, not after it.
void CheckMeshFileName(const std::filesystem::path& path);

// Whether WriteMeshFile made the file, by its beginning.
bool IsMeshFile(const std::filesystem::path& path);

// A PLY written by WriteMeshFile. Throws Error on a damaged file.
SurfaceMesh ReadSurfaceMesh(const std::filesystem::path& path);

}  // namespace polarscan
