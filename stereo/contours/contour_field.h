// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/image.h"
#include "stereo/contours/labels.h"
#include "stereo/costs/problem.h"

namespace polarscan {

// Which way the contours of equal distance run through a view: at each pixel w (cos 2 theta, sin 2 theta), theta the
// direction in the picture (axes x right, y down), w from 0 (nothing is known) to 1. Twice the angle, since a contour
// has no sense of direction: that is why the 180-degree ambiguity of the azimuth does not matter.
class ContourField {
 public:
  // From the AoP with its label: the contour is perpendicular to the azimuth, by the perspective formula
  // (AopConstraint: the vector m is a tangent of the surface; where it goes in the picture). Smoothed over 3x3 pixels,
  // zero outside of the mask.
  ContourField(const Problem& problem, const Image<Reflection>& labels);

  // Bilinear between pixel centres at integers; zero outside of the picture.
  Eigen::Vector2f At(const Eigen::Vector2f& place) const;

  // Unit direction of a doubled one that is not zero; to the right, or down.
  static Eigen::Vector2f Direction(const Eigen::Vector2f& doubled);

  // The unit tangent of the surface along the contour at a pixel, camera frame; zero where nothing is known.
  Eigen::Vector3f Tangent(const Problem& problem, int x, int y) const;

 private:
  Image<Eigen::Vector2f> doubled_;
};

}  // namespace polarscan
