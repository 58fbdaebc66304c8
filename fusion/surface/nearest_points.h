// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace polarscan {

// The `count` nearest points of each query, nearest first (fewer if there are not so many): index and
// distance. In parallel.
struct NearPoint {
  std::uint32_t index = 0;
  double distance = 0;
};
std::vector<std::vector<NearPoint>> NearestPoints(const std::vector<Eigen::Vector3d>& points,
                                                  const std::vector<Eigen::Vector3d>& queries, int count);

// Distance of each query to its nearest point; infinite if there are no points. In parallel.
std::vector<double> NearestDistances(const std::vector<Eigen::Vector3d>& points,
                                     const std::vector<Eigen::Vector3d>& queries);

}  // namespace polarscan
