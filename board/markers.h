// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/image.h"

namespace polarscan {

// A marker of dictionary 5x5_250 in a picture: its black square's corners, clockwise from the upper left as it
// is printed; centres of pixels at integer + 0.5. Right to a pixel or so.
struct FoundMarker {
  int id = 0;
  std::array<Eigen::Vector2d, 4> corners;
};

// By OpenCV's ArUco; sorted by id. A marker that stands twice in the picture is there twice.
std::vector<FoundMarker> FindMarkers(const Image<std::uint8_t>& grey);

// Whether a cell of the marker is black, rows from the top, with the border: kMarkerCells a side.
std::array<std::array<bool, 7>, 7> MarkerCells(int id);

// Moves points to the saddles near them, within windows of radius_px[i] (cv::cornerSubPix). Pixel centres as
// above.
void RefineCorners(const Image<float>& picture, const std::vector<int>& radius_px,
                   std::vector<Eigen::Vector2d>& points);

}  // namespace polarscan
