// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/inverse_rendering/smoothness.h"

#include <ceres/cost_function.h>
#include <ceres/jet.h>
#include <ceres/sized_cost_function.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace polarscan {
namespace {

constexpr double kPower = 2.2;          // q of the geometric smoothness term
constexpr double kLeastSquare = 1e-18;  // added to the squared sine of the angle: its root has a derivative
constexpr int kStarVertices = 6;

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

class StarCost : public ceres::CostFunction {
 public:
  StarCost(const MovingSurface& surface, const FacetStar& star, std::vector<std::uint32_t> vertices,
           double weight)
      : surface_(surface), vertices_(std::move(vertices)), scale_(std::sqrt(weight)) {
    for (std::size_t f = 0; f < star.size(); ++f)
      for (std::size_t i = 0; i < 3; ++i)
        slots_[f][i] = std::size_t(std::ranges::find(vertices_, star[f][i]) - vertices_.begin());
    set_num_residuals(3);
    mutable_parameter_block_sizes()->assign(vertices_.size(), 1);
  }

  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    std::array<ceres::Jet<double, kStarVertices>, kStarVertices> moves;
    std::array<double, kStarVertices> values{};
    for (std::size_t i = 0; i < vertices_.size(); ++i) values[i] = x[i][0], moves[i] = {x[i][0], int(i)};
    if (!jacobians) {
      Eigen::Map<Eigen::Vector3d>(residuals, 3) = Residual(values);
      return true;
    }
    const auto result = Residual(moves);
    for (int row = 0; row < 3; ++row) {
      residuals[row] = result[row].a;
      for (std::size_t i = 0; i < vertices_.size(); ++i)
        if (jacobians[i]) jacobians[i][row] = result[row].v[Eigen::Index(i)];
    }
    return true;
  }

 private:
  template <class T>
  Vector3<T> UnitNormal(std::size_t facet, const std::array<T, kStarVertices>& moves) const {
    std::array<Vector3<T>, 3> p;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t slot = slots_[facet][i];
      const Eigen::Vector3d along = surface_.unit * surface_.mesh.normals[vertices_[slot]];
      p[i] = surface_.mesh.vertices[vertices_[slot]].cast<T>() + along.cast<T>() * moves[slot];
    }
    const Vector3<T> normal = (p[1] - p[0]).cross(p[2] - p[0]);
    return normal / sqrt(normal.squaredNorm() + T(1e-60));
  }

  // The direction of the axis that turns the one normal into the other, as long as the cost's root.
  template <class T>
  Vector3<T> Residual(const std::array<T, kStarVertices>& moves) const {
    using std::atan2, std::pow, std::sqrt;
    const Vector3<T> own = UnitNormal(0, moves);
    const Vector3<T> sum = UnitNormal(1, moves) + UnitNormal(2, moves) + UnitNormal(3, moves);
    const Vector3<T> mean = sum / sqrt(sum.squaredNorm() + T(1e-60));
    const Vector3<T> axis = mean.cross(own);
    const T sine = sqrt(axis.squaredNorm() + T(kLeastSquare));
    const T share = atan2(sine, own.dot(mean)) / T(std::numbers::pi);
    return axis * (T(scale_) * pow(share, T(kPower / 2)) / sine);
  }

  const MovingSurface& surface_;
  std::vector<std::uint32_t> vertices_;
  std::array<std::array<std::size_t, 3>, 4> slots_{};
  double scale_;
};

class AlbedoCost : public ceres::SizedCostFunction<1, 1, 1> {
 public:
  explicit AlbedoCost(double weight) : scale_(std::sqrt(weight)) {}
  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    residuals[0] = scale_ * (x[0][0] - x[1][0]);
    if (!jacobians) return true;
    if (jacobians[0]) jacobians[0][0] = scale_;
    if (jacobians[1]) jacobians[1][0] = -scale_;
    return true;
  }

 private:
  double scale_;
};

class AnchorCost : public ceres::SizedCostFunction<1, 1> {
 public:
  AnchorCost(double weight, double before) : scale_(std::sqrt(weight)), before_(before) {}
  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    residuals[0] = scale_ * (x[0][0] + before_);
    if (jacobians && jacobians[0]) jacobians[0][0] = scale_;
    return true;
  }

 private:
  double scale_, before_;
};

}  // namespace

FacetStars MakeFacetStars(std::span<const Triangle> triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::size_t>> facets_of;
  for (std::size_t f = 0; f < triangles.size(); ++f)
    for (std::size_t i = 0; i < 3; ++i)
      facets_of[std::minmax(triangles[f][i], triangles[f][(i + 1) % 3])].push_back(f);
  FacetStars stars(triangles.size());
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    FacetStar star{triangles[f]};
    bool whole = true;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& both = facets_of[std::minmax(triangles[f][i], triangles[f][(i + 1) % 3])];
      whole = whole && both.size() == 2;
      if (whole) star[i + 1] = triangles[both[0] == f ? both[1] : both[0]];
    }
    if (whole) stars[f] = star;
  }
  return stars;
}

FacetCost MakeFacetCost(const MovingSurface& surface, const FacetStar& star, double weight) {
  std::vector<std::uint32_t> vertices;
  for (const Triangle& triangle : star)
    for (std::uint32_t v : triangle)
      if (std::ranges::find(vertices, v) == vertices.end()) vertices.push_back(v);
  return {std::make_unique<StarCost>(surface, star, vertices, weight), vertices};
}

std::unique_ptr<ceres::CostFunction> MakeAlbedoCost(double weight) {
  return std::make_unique<AlbedoCost>(weight);
}

std::unique_ptr<ceres::CostFunction> MakeAnchorCost(double weight, double before) {
  return std::make_unique<AnchorCost>(weight, before);
}

}  // namespace polarscan
