// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "core/mesh.h"

namespace polarscan::test {

// A scan folder as the pipeline would leave it, made from closed forms: a shiny ball of radius 1 on a
// checkered table, `views` cameras around it; Stokes views, pictures, true depth and normal maps, and the
// cloud of their points. Diffuse polarization: AoP = azimuth of the normal (docs/conventions.md).
void WriteToyScan(const std::filesystem::path& folder, int views, int width = 160, int height = 120);

// A ball of radius 1 with 2600 vertices and their normals.
TriangleMesh Ball();

}  // namespace polarscan::test
