// SPDX-License-Identifier: Apache-2.0
#include "core/similarity.h"

#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <string>

#include "core/error.h"

namespace polarscan {
namespace {

Eigen::Matrix3Xd Columns(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Matrix3Xd columns(3, Eigen::Index(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) columns.col(Eigen::Index(i)) = points[i];
  return columns;
}

bool OnOneLine(const Eigen::Matrix3Xd& points) {
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::Matrix3d scatter = centred * centred.transpose();
  const Eigen::Vector3d spread =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter, Eigen::EigenvaluesOnly).eigenvalues();
  return spread[1] <= 1e-12 * spread[2];  // ascending, and squares
}

}  // namespace

// cam = R_c x_s + t_c with x_s = R^T (x_t - t) / s; scaled by s: R_c R^T x_t - R_c R^T t + s t_c.
Rigid Similarity::operator()(const Rigid& cam_from_source) const {
  const Eigen::Matrix3d r = cam_from_source.rotation * rotation.transpose();
  return {r, scale * cam_from_source.translation - r * translation};
}

Similarity EstimateSimilarity(const std::vector<Eigen::Vector3d>& source,
                              const std::vector<Eigen::Vector3d>& target) {
  const std::string pairs = std::to_string(source.size()) + " pairs of points";
  if (source.size() != target.size() || source.size() < 3)
    throw Error("three pairs of points are needed for an alignment", pairs);
  const Eigen::Matrix3Xd from = Columns(source), to = Columns(target);
  if (OnOneLine(from) || OnOneLine(to))
    throw Error("the points to align lie on one line, so their rotation is not determined", pairs);
  const Eigen::Matrix4d m = Eigen::umeyama(from, to, true);
  Similarity similarity;
  similarity.scale = m.topLeftCorner<3, 1>().norm();
  similarity.rotation = m.topLeftCorner<3, 3>() / similarity.scale;
  similarity.translation = m.topRightCorner<3, 1>();
  return similarity;
}

Eigen::Vector3d LocalOrigin(const Eigen::Vector3d& centre, double extent) {
  constexpr double kFar = 100;
  if (!(extent > 0) || centre.norm() <= kFar * extent) return Eigen::Vector3d::Zero();
  const double round = std::pow(10, std::ceil(std::log10(extent)));
  return round * (centre / round).array().round().matrix();
}

}  // namespace polarscan
