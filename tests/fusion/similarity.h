// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Geometry>

#include "stereo/sfm/alignment.h"

namespace polarscan {

// One that changes everything: turn, scale and place.
inline Similarity SomeSimilarity() {
  Similarity s;
  s.scale = 2.5;
  s.rotation = Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, 2, -0.5).normalized()).toRotationMatrix();
  s.translation = {10, -4, 7};
  return s;
}

}  // namespace polarscan
