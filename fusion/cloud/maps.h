// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <string>

#include "core/cache.h"
#include "core/camera.h"
#include "core/image.h"
#include "stereo/workspace.h"

namespace polarscan {

// What fusion needs of one view, all on the grid of its depth map (which may be smaller than the picture).
struct ViewMaps {
  Pinhole camera;  // of that grid
  Rigid cam_from_world;
  Image<float> depth;             // z, world units; 0: no estimate, no normal, or outside of the mask
  Image<Eigen::Vector3f> normal;  // unit, camera frame, towards the camera
  Image<Rgb8> colour;
  Image<float> dop;
  std::size_t pixels_with_depth = 0, pixels_masked = 0, pixels_without_normal = 0;
  std::size_t pixels_inside = 0, pixels_outside = 0;  // of the mask; none where there is one that is not used

  static constexpr std::size_t kBytesPerPixel = 5 * sizeof(float) + sizeof(Rgb8);
  std::size_t Bytes() const { return depth.size() * kBytesPerPixel; }
};

// The best result that any view has. Throws Error if there are no maps at all.
MapKind BestMapKind(const Workspace& workspace);
// The same, or the one of this name if it is not "auto".
MapKind MapKindOf(const std::string& name, const Workspace& workspace);
bool HasMaps(const Workspace& workspace, int view, const MapKind& kind);

// Reads a view's maps, picture and polarization. Throws Error naming a file that is missing, damaged or of
// another size than its partner.
ViewMaps LoadViewMaps(const Workspace& workspace, int view, const MapKind& kind, bool masks);

// A view's maps, or why there are none.
struct MapsOrDamage {
  ViewMaps maps;
  std::string damage;
};

// As they are asked for, from files read by several threads at once.
Cache<MapsOrDamage> CachedViewMaps(const Workspace& workspace, const MapKind& kind, bool masks,
                                   std::size_t limit_bytes);

}  // namespace polarscan
