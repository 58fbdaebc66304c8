// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <limits>
#include <nanoflann.hpp>

#include "core/parallel.h"
#include "fusion/surface.h"

namespace polarscan {
namespace {

// How nanoflann sees a vector of points. The names are its own.
struct PointSet {
  const std::vector<Eigen::Vector3d>& points;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const { return points[i][Eigen::Index(axis)]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointSet>, PointSet, 3>;

}  // namespace

std::vector<double> NearestDistances(const std::vector<Eigen::Vector3d>& points,
                                     const std::vector<Eigen::Vector3d>& queries) {
  std::vector<double> distances(queries.size(), std::numeric_limits<double>::infinity());
  if (points.empty()) return distances;
  const PointSet set{points};
  const Tree tree(3, set);
  ParallelFor(0, int(queries.size()), [&](int i) {
    std::uint32_t index = 0;  // nanoflann's type
    double squared = 0;
    tree.knnSearch(queries[std::size_t(i)].data(), 1, &index, &squared);
    distances[std::size_t(i)] = std::sqrt(squared);
  });
  return distances;
}

}  // namespace polarscan
