// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/error.h"
#include "core/image.h"
#include "demosaic/stokes.h"

namespace polarscan {

// The part of a picture that a view's camera describes: its first pixel, and the whole picture's size.
struct PictureWindow {
  int left = 0, top = 0, picture_width = 0, picture_height = 0;
};

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
// NAME is the input picture's stem. stereo/ holds other kinds of maps while it is made. A workspace that
// COLMAP made (stereo/dense/colmap_workspace.h) holds plain photos: no polar/, pictures of any kind and in
// any folders below images/.
struct DenseView {
  std::string name;  // of the picture without its extension
  Pinhole camera;    // pixel centres at integer + 0.5
  Rigid cam_from_world;
  double depth_min = 0, depth_max = 0;    // of the object or scene, world units, > 0
  std::vector<int> sources;               // indices into Workspace::views, best first
  std::string picture{};                  // below images/; empty: NAME.png
  std::optional<PictureWindow> window{};  // in memory only (stereo/dense/crop.h); none: the whole picture
};

// Kinds of maps: the result, and what each view made before all views were drawn together
// (pipeline/stereo/surface_maps.h).
inline constexpr const char* kFinalMaps = "geometric";
inline constexpr const char* kSeparateMaps = "separate";

// The picture's name without its extension: "left/0001.jpg" gives "left/0001".
std::string ViewName(const std::string& picture);

struct Workspace {
  std::filesystem::path folder;
  std::vector<DenseView> views;                      // sorted by name
  bool polarized = false;                            // false: plain photos, S1 = S2 = 0 everywhere
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // added to coordinates: those of the given poses

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
  // kind: as above, or another step's.
  std::filesystem::path DepthPath(int view, const std::string& kind) const {
    return folder / "stereo/depth_maps" / (PictureName(view) + "." + kind + ".bin");
  }
  std::filesystem::path NormalPath(int view, const std::string& kind) const {
    return folder / "stereo/normal_maps" / (PictureName(view) + "." + kind + ".bin");
  }
};

// Whether two views were taken from one place: their centres are within 0.5 % of the depth that they look at
// (0.3 degrees between their rays; structure from motion errs by less), so that together they tell no depth
// and bear witness once. False where a view has no depth range.
bool SamePlace(const DenseView& a, const DenseView& b);
// For each view the first view that was taken from its place: itself, if none was before it.
std::vector<int> Places(const std::vector<DenseView>& views);
// The median angle, degrees, between a view and the nearest one from another place, as seen from what it
// looks at (the middle of its depths). 0 for fewer than two places.
double NeighbourAngle(const std::vector<DenseView>& views);

// Reads views.json. Throws Error if the folder holds no workspace of ours or a damaged one.
Workspace ReadWorkspace(const std::filesystem::path& folder);
// The views with one of these names, and what they say of each other. names: separated by commas, with * and
// ? as in a shell; empty: all. Throws Error if a name is none of a view, or fewer than two are left.
Workspace ChosenViews(const Workspace& workspace, const std::string& names);
// Writes views.json (nothing else), atomically.
void WriteWorkspace(const Workspace& workspace);

// The view's light from LightPath: a photo's has S1 = S2 = 0 (8 bits: by gamma 2.2). In a view's window, as
// the mask. Throws Error if the file is damaged or of another size than the camera.
StokesImage ReadViewLight(const Workspace& workspace, int view);

// The view's mask, or an empty image if the workspace has none for it.
Image<std::uint8_t> ReadViewMask(const Workspace& workspace, int view);

// The view's window of an image of its whole picture. Throws Error if that has another size.
template <class T>
Image<T> InWindow(const DenseView& view, Image<T> picture) {
  if (!view.window) return picture;
  if (picture.width() != view.window->picture_width || picture.height() != view.window->picture_height)
    throw Error("an image of another size than the view's picture", view.name);
  return Cropped(picture, view.window->left, view.window->top, view.camera.width, view.camera.height);
}

}  // namespace polarscan
