// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"

namespace polarscan {

// Procedural objects, y up, outward, in units of their own (see Normalize): "bear" (a sitting toy), "vase" (a
// fluted surface of revolution with a mouth), "knot" (a trefoil tube standing on its side), "sphere". Throws
// Error on another name.
TriangleMesh NamedShape(const std::string& name, const Progress& progress = {});
std::vector<std::string> ShapeNames();

// Drops vertices that no triangle uses, and scales the rest into the unit sphere around the origin (smallest
// enclosing sphere by Badoiu and Clarkson, SODA 2003, to about 1e-3). Throws Error if nothing is left.
void Normalize(TriangleMesh& mesh);

}  // namespace polarscan
