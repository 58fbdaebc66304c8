// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <list>
#include <memory>
#include <string>
#include <vector>

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

// "geometric" if any view has a geometric depth map, else "photometric". Throws Error if there are no maps at
// all.
std::string BestMapKind(const Workspace& workspace);
bool HasMaps(const Workspace& workspace, int view, const std::string& kind);

// Reads a view's maps, picture and polarization. Throws Error naming a file that is missing, damaged or of
// another size than its partner.
ViewMaps LoadViewMaps(const Workspace& workspace, int view, const std::string& kind, bool masks);

// The maps of the views used last, up to a limit of bytes (at least those asked for together). To be used by
// one thread; it reads files with several.
class MapCache {
 public:
  // A view's maps, or why there are none.
  struct Entry {
    std::shared_ptr<const ViewMaps> maps;
    std::string damage;
  };

  MapCache(const Workspace& workspace, std::string kind, bool masks, std::size_t limit_bytes);
  ~MapCache();  // gives the memory back to the system
  std::vector<Entry> Get(const std::vector<int>& views);

 private:
  Entry Load(int view) const;
  void Use(int view);
  void Keep(int view, const std::shared_ptr<const ViewMaps>& maps);
  void ShrinkTo(std::size_t bytes);

  const Workspace& workspace_;
  std::string kind_;
  bool masks_;
  std::size_t limit_bytes_, bytes_ = 0;
  std::vector<std::shared_ptr<const ViewMaps>> maps_;
  std::list<int> recent_;  // most recent first
};

}  // namespace polarscan
