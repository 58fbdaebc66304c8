// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Geometry>
#include <functional>

#include "core/mesh.h"
#include "core/progress.h"

namespace polarscan {

// A solid as a function of space: negative inside, roughly a distance near the surface. Pure, called from
// many threads.
using Implicit = std::function<double(const Eigen::Vector3d&)>;

// The surface f = 0 inside the box as triangles on a grid of `cells` cells along the box's longest side:
// surface nets (Gibson, MICCAI 1998), each vertex then moved onto the surface by Newton steps; normals are
// the gradient's direction. The surface must not touch the box.
TriangleMesh MeshImplicit(const Implicit& f, const Eigen::AlignedBox3d& box, int cells,
                          const Progress& progress = {});

}  // namespace polarscan
