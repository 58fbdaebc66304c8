// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <string>

#include "stereo/sfm/model/model.h"

namespace polarscan {

// COLMAP's camera models, 3.8 to 4.x: the number in cameras.bin and in the database, and how many parameters
// follow.
struct CameraModel {
  int id;
  const char* name;
  int parameters;
};
const CameraModel* FindCameraModel(int id);                   // nullptr: unknown
const CameraModel* FindCameraModel(const std::string& name);  // nullptr: unknown

// How many of a model's parameters, the first ones, are focal lengths: 1 or 2.
int FocalLengths(const std::string& model);

// A lens: pixel = focal length * distorted + principal point, where (COLMAP's and OpenCV's convention, x and
// y are normalised coordinates, r^2 = x^2 + y^2)
//   distorted = (x, y) (1 + k1 r^2 + k2 r^4) + (2 p1 x y + p2 (r^2 + 2 x^2), p1 (r^2 + 2 y^2) + 2 p2 x y).
// SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL and OPENCV are all of this form, and FULL_OPENCV if its k3
// to k6 are 0. The distortion is a gradient field (its Jacobian is symmetric), so locally it stretches but
// never turns: the frame that angles of polarization are counted in stays as it is.
struct Lens {
  Pinhole pinhole;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0;

  bool IsPinhole() const { return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0; }
  Eigen::Vector2d Distort(const Eigen::Vector2d& normalised) const;
  // Inverse of Distort by Newton's method; the start if it does not converge (far outside of the picture).
  Eigen::Vector2d Undistort(const Eigen::Vector2d& distorted) const;
};

// Throws Error naming the model if it is none of these.
Lens ToLens(const ColmapCamera& camera);

// The same camera looked at through a picture of another size; throws Error if the shape differs by more than
// a pixel.
ColmapCamera Resized(const ColmapCamera& camera, int width, int height);

}  // namespace polarscan
