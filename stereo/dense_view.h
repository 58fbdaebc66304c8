// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/error.h"
#include "core/image.h"

namespace polarscan {

// The part of a picture that a view's camera describes: its first pixel, and the whole picture's size.
struct PictureWindow {
  int left = 0, top = 0, picture_width = 0, picture_height = 0;
};

// A view of a dense workspace (stereo/workspace.h).
struct DenseView {
  std::string name;  // of the picture without its extension
  Pinhole camera;    // pixel centres at integer + 0.5
  Rigid cam_from_world;
  double depth_min = 0, depth_max = 0;    // of the object or scene, world units, > 0
  std::vector<int> sources;               // indices into Workspace::views, best first
  std::string picture{};                  // below images/; empty: NAME.png
  std::optional<PictureWindow> window{};  // in memory only (stereo/dense/crop.h); none: the whole picture
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

// The view's window of an image of its whole picture. Throws Error if that has another size.
template <class T>
Image<T> InWindow(const DenseView& view, Image<T> picture) {
  if (!view.window) return picture;
  if (picture.width() != view.window->picture_width || picture.height() != view.window->picture_height)
    throw Error("an image of another size than the view's picture", view.name);
  return Cropped(picture, view.window->left, view.window->top, view.camera.width, view.camera.height);
}

}  // namespace polarscan
