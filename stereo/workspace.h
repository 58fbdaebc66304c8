// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"
#include "demosaic/stokes.h"
#include "stereo/dense_view.h"
#include "stereo/map_kind.h"

namespace polarscan {

// COLMAP's dense workspace with our additions:
//   images/NAME.png     undistorted 8-bit pictures (for COLMAP's tools, colours, people)
//   sparse/             PINHOLE cameras. COLMAP's dense tools use the integer pixel index with that principal
//                       point, so the exported cx, cy are ours - 0.5 (the half-pixel trap,
//                       docs/conventions.md)
//   polar/NAME.tif      undistorted Stokes views (demosaic/stokes.h)
//   masks/NAME.png      undistorted masks, 255 = object (optional)
//   stereo/depth_maps/NAME.png.{photometric,geometric}.bin, stereo/normal_maps/..., patch-match.cfg,
//   fusion.cfg          for COLMAP
//   stereo/poses.json   poses that fit the surface better (stereo/refined_poses.h)
//   stereo/polarization.json   what is wrong with all views' polarization (pipeline/stereo/corrections/polarization_fit.h)
//   views.json          what COLMAP's files cannot hold: the cameras at pixel centres, depth ranges, sources
// NAME is the input picture's stem. stereo/ holds other kinds of maps while it is made. A workspace that
// COLMAP made (stereo/dense/colmap/colmap_workspace.h) holds plain photos: no polar/, pictures of any kind
// and in any folders below images/. The picture's name without its extension: "left/0001.jpg" gives
// "left/0001".
std::string ViewName(const std::string& picture);

struct Workspace {
  std::filesystem::path folder;
  std::vector<DenseView> views;                      // sorted by name
  bool polarized = false;                            // false: plain photos, S1 = S2 = 0 everywhere
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // added to coordinates: those of the given poses
  PolarizationCorrection correction = {};            // what ReadViewLight mends

  // Below images/; the maps are named after it.
  std::string PictureName(int view) const {
    const DenseView& v = views[std::size_t(view)];
    return v.picture.empty() ? v.name + ".png" : v.picture;
  }
  std::filesystem::path PicturePath(int view) const { return folder / "images" / PictureName(view); }
  std::filesystem::path StokesPath(int view) const { return folder / "polar" / (views[view].name + ".tif"); }
  std::filesystem::path MaskPath(int view) const { return folder / "masks" / (views[view].name + ".png"); }
  // What stereo reads: the Stokes view, or the picture where there is none.
  std::filesystem::path LightPath(int view) const;
  std::filesystem::path DepthPath(int view, const MapKind& kind) const {
    return folder / "stereo/depth_maps" / (PictureName(view) + "." + ToString(kind) + ".bin");
  }
  std::filesystem::path NormalPath(int view, const MapKind& kind) const {
    return folder / "stereo/normal_maps" / (PictureName(view) + "." + ToString(kind) + ".bin");
  }
};

// Reads views.json, and stereo/polarization.json and stereo/poses.json if they are there. Throws Error if the folder
// holds no workspace of ours or a damaged one.
Workspace ReadWorkspace(const std::filesystem::path& folder);
// Of views.json alone: neither polarization nor poses are corrected.
Workspace ReadWorkspaceAsGiven(const std::filesystem::path& folder);
// The views with one of these names, and what they say of each other. names: separated by commas, with * and
// ? as in a shell; empty: all. Throws Error if a name is none of a view, or fewer than two are left.
Workspace ChosenViews(const Workspace& workspace, const std::string& names);
// Writes views.json (nothing else), atomically.
void WriteWorkspace(const Workspace& workspace);

// stereo/polarization.json: the correction, and a hash of what it was found from. None if it is not there.
struct FoundCorrection {
  PolarizationCorrection correction;
  std::string inputs;
};
std::optional<FoundCorrection> ReadCorrection(const Workspace& workspace);
void WriteCorrection(const Workspace& workspace, const FoundCorrection& found);
void RemoveCorrection(const Workspace& workspace);

// The view's light from LightPath, corrected: a photo's has S1 = S2 = 0 (8 bits: by gamma 2.2). In a view's window, as
// the mask. Throws Error if the file is damaged or of another size than the camera.
StokesImage ReadViewLight(const Workspace& workspace, int view);

// The view's mask, or an empty image if the workspace has none for it.
Image<std::uint8_t> ReadViewMask(const Workspace& workspace, int view);

}  // namespace polarscan
