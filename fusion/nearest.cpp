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

std::vector<Neighbour> FindNearest(const std::vector<Eigen::Vector3d>& points,
                                   const std::vector<Eigen::Vector3d>& queries) {
  std::vector<Neighbour> nearest(queries.size(), {0, std::numeric_limits<double>::infinity()});
  if (points.empty()) return nearest;
  const PointSet set{points};
  const Tree tree(3, set);
  ParallelFor(0, int(queries.size()), [&](int i) {
    Neighbour& found = nearest[std::size_t(i)];
    tree.knnSearch(queries[std::size_t(i)].data(), 1, &found.index, &found.distance);
    found.distance = std::sqrt(found.distance);  // nanoflann gives squares
  });
  return nearest;
}

std::vector<double> NearestDistances(const std::vector<Eigen::Vector3d>& points,
                                     const std::vector<Eigen::Vector3d>& queries) {
  std::vector<double> distances;
  distances.reserve(queries.size());
  for (const Neighbour& neighbour : FindNearest(points, queries)) distances.push_back(neighbour.distance);
  return distances;
}

}  // namespace polarscan
