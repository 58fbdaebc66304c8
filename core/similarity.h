// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <vector>

#include "core/camera.h"

namespace polarscan {

// x_target = scale * rotation * x_source + translation.
struct Similarity {
  double scale = 1;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return scale * (rotation * x) + translation; }
  // The pose of a camera after its world has been moved to the target. Depths grow by `scale`.
  Rigid operator()(const Rigid& cam_from_source) const;
};

// The similarity that takes `source` to `target` with the least sum of squared distances (Umeyama, TPAMI
// 1991). Throws Error if there are fewer than three pairs or the points lie on one line, where the rotation
// is not determined.
Similarity EstimateSimilarity(const std::vector<Eigen::Vector3d>& source,
                              const std::vector<Eigen::Vector3d>& target);

// Where to count coordinates from so that single precision keeps their detail: 0 for things of size `extent`
// around `centre` within 100 of their sizes of 0 (then its steps are 1e-5 of the size); else a round place
// near the centre.
Eigen::Vector3d LocalOrigin(const Eigen::Vector3d& centre, double extent);

}  // namespace polarscan
