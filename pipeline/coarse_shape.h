// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/random.h"
#include "stereo/workspace.h"

namespace polarscan {

// What depth maps say of the shape on the whole, for those who ask whether the polarization fits it: wrong angles
// bend small forms and normals, and this little.

// Evenly chosen, at most 40 of the views with maps of that kind.
std::vector<int> SomeViews(const Workspace& workspace, const MapKind& kind);

// A pixel, and the normal of its wider surroundings: camera frame, unit, facing the camera.
struct CoarseNormal {
  int x, y;
  Eigen::Vector3d normal;
};

// At `count` random pixels with a depth; none where fewer than half of those around have one. The surroundings are
// small beside the picture and beside the object. camera: of the map's size.
std::vector<CoarseNormal> CoarseNormals(const Image<float>& depth, const Pinhole& camera, int count,
                                        Random random);

}  // namespace polarscan
