// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "demosaic/stokes.h"

namespace polarscan {

// COLMAP's dense workspace with our additions:
//   images/NAME.png               undistorted 8-bit pictures (for COLMAP's tools, colours, people)
//   sparse/                       PINHOLE cameras. COLMAP's dense tools use the integer pixel index with that
//   principal
//                                 point, so the exported cx, cy are ours - 0.5 (the half-pixel trap,
//                                 docs/conventions.md)
//   polar/NAME.tif                undistorted Stokes views (demosaic/stokes.h)
//   masks/NAME.png                undistorted masks, 255 = object (optional)
//   stereo/depth_maps/NAME.png.{photometric,geometric}.bin, stereo/normal_maps/..., patch-match.cfg,
//   fusion.cfg views.json                    what COLMAP's files cannot hold: the cameras at pixel centres,
//   depth ranges, sources
// NAME is the input picture's stem.
struct DenseView {
  std::string name;  // stem, without extension
  Pinhole camera;    // pixel centres at integer + 0.5
  Rigid cam_from_world;
  double depth_min = 0, depth_max = 0;  // of the object or scene, world units, > 0
  std::vector<int> sources;             // indices into Workspace::views, best first
};

struct Workspace {
  std::filesystem::path folder;
  std::vector<DenseView> views;  // sorted by name
  bool polarized = false;        // false: plain photos, S1 = S2 = 0 everywhere

  std::filesystem::path PicturePath(int view) const {
    return folder / "images" / (views[view].name + ".png");
  }
  std::filesystem::path StokesPath(int view) const { return folder / "polar" / (views[view].name + ".tif"); }
  std::filesystem::path MaskPath(int view) const { return folder / "masks" / (views[view].name + ".png"); }
  // kind: "photometric" or "geometric".
  std::filesystem::path DepthPath(int view, const std::string& kind) const {
    return folder / "stereo/depth_maps" / (views[view].name + ".png." + kind + ".bin");
  }
  std::filesystem::path NormalPath(int view, const std::string& kind) const {
    return folder / "stereo/normal_maps" / (views[view].name + ".png." + kind + ".bin");
  }
};

// Reads views.json. Throws Error if the folder holds no workspace of ours or a damaged one.
Workspace ReadWorkspace(const std::filesystem::path& folder);
// Writes views.json (nothing else), atomically.
void WriteWorkspace(const Workspace& workspace);

// The view's mask, or an empty image if the workspace has none for it.
Image<std::uint8_t> ReadViewMask(const Workspace& workspace, int view);

}  // namespace polarscan
