// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>

#include "stereo/sfm/model/camera_models.h"

namespace polarscan {

// Where a lens shows a point (x, y, z) of the camera's frame, px: Lens::Distort and the pinhole, for numbers
// that carry derivatives.
template <class T>
Eigen::Matrix<T, 2, 1> ProjectThrough(const Lens& lens, const T* p) {
  const T x = p[0] / p[2], y = p[1] / p[2], r2 = x * x + y * y;
  const T radial = 1.0 + r2 * (lens.k1 + r2 * lens.k2);
  const T u = x * radial + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x);
  const T v = y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2 * lens.p2 * x * y;
  return {lens.pinhole.fx * u + lens.pinhole.cx, lens.pinhole.fy * v + lens.pinhole.cy};
}

}  // namespace polarscan
