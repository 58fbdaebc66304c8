// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/nearest_points.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <nanoflann.hpp>

#include "core/parallel.h"

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

std::vector<std::vector<NearPoint>> NearestPoints(const std::vector<Eigen::Vector3d>& points,
                                                  const std::vector<Eigen::Vector3d>& queries, int count) {
  std::vector<std::vector<NearPoint>> nearest(queries.size());
  if (points.empty()) return nearest;
  const PointSet set{points};
  const Tree tree(3, set);
  const auto most = std::size_t(count);
  ParallelFor(0, int(queries.size()), [&](int i) {
    std::vector<std::uint32_t> indices(most);  // nanoflann's type
    std::vector<double> squared(most);
    const auto found = tree.knnSearch(queries[std::size_t(i)].data(), most, indices.data(), squared.data());
    for (std::size_t k = 0; k < found; ++k)
      nearest[std::size_t(i)].push_back({indices[k], std::sqrt(squared[k])});
  });
  return nearest;
}

std::vector<double> NearestDistances(const std::vector<Eigen::Vector3d>& points,
                                     const std::vector<Eigen::Vector3d>& queries) {
  std::vector<double> distances(queries.size(), std::numeric_limits<double>::infinity());
  const auto nearest = NearestPoints(points, queries, 1);
  for (std::size_t i = 0; i < queries.size(); ++i)
    if (!nearest[i].empty()) distances[i] = nearest[i].front().distance;
  return distances;
}

}  // namespace polarscan
