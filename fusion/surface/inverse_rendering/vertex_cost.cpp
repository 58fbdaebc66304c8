// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/inverse_rendering/vertex_cost.h"

#include <ceres/cost_function.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace polarscan {
namespace {

constexpr double kConcave = 0.5;     // k of the concave-shaped function
constexpr double kNoLength = 1e-30;  // of a normal that no triangle gives

// A unit normal and its derivatives by the moves of the vertex and of its neighbours, a column each.
struct MovingNormal {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd slopes;
};

class VertexCost : public ceres::CostFunction {
 public:
  VertexCost(const MovingSurface& surface, const Observed& observed, std::uint32_t vertex)
      : surface_(surface),
        observed_(observed),
        vertex_(vertex),
        around_(surface.neighbours.Of(vertex)),
        samples_(observed.samples.Of(vertex)) {
    set_num_residuals(2 * int(samples_.size()));
    mutable_parameter_block_sizes()->assign(around_.size() + 2, 1);
  }

  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    const MovingNormal at = NormalAt(x);
    const double albedo = x[around_.size() + 1][0];
    const Harmonics harmonics = HarmonicsAt(at.normal);
    const Eigen::Matrix<double, 9, 3> slopes = HarmonicSlopes(at.normal);
    const double share = 1 / double(samples_.size());
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const VertexSample& sample = samples_[i];
      const Harmonics& light = observed_.lights[std::size_t(sample.view)];
      const double pho = std::sqrt(observed_.photometric * share);
      const double pol = std::sqrt(observed_.polarimetric * share * double(sample.aop.weight));
      const AzimuthResidual azimuth = ConcaveAzimuth(sample.aop, at.normal);
      const double shading = light.dot(harmonics);
      residuals[2 * i] = pho * (albedo * shading - double(sample.intensity));
      residuals[2 * i + 1] = pol * azimuth.value;
      if (!jacobians) continue;
      const Eigen::RowVector3d by_normal = pho * albedo * light.transpose() * slopes;
      SetRow(2 * i, by_normal * at.slopes, pho * shading, jacobians);
      SetRow(2 * i + 1, pol * azimuth.slope.transpose() * at.slopes, 0, jacobians);
    }
    return true;
  }

 private:
  // A residual's derivatives, by the moves and by the albedo.
  void SetRow(std::size_t row, const Eigen::RowVectorXd& by_moves, double by_albedo,
              double** jacobians) const {
    for (std::size_t k = 0; k <= around_.size(); ++k)
      if (jacobians[k]) jacobians[k][row] = by_moves[Eigen::Index(k)];
    if (double* column = jacobians[around_.size() + 1]) column[row] = by_albedo;
  }

  // Which parameter moves a corner of one of the vertex' triangles.
  std::size_t Slot(std::uint32_t corner) const {
    if (corner == vertex_) return 0;
    return std::size_t(std::ranges::lower_bound(around_, corner) - around_.begin()) + 1;
  }

  MovingNormal NormalAt(const double* const* x) const {
    const TriangleMesh& mesh = surface_.mesh;
    const auto place = [&](std::uint32_t v) -> Eigen::Vector3d {
      return mesh.vertices[v] + x[Slot(v)][0] * surface_.unit * mesh.normals[v];
    };
    MovingNormal sum{Eigen::Vector3d::Zero(), Eigen::Matrix3Xd::Zero(3, Eigen::Index(around_.size() + 1))};
    for (std::uint32_t f : surface_.neighbours.TrianglesOf(vertex_)) {
      const Triangle& t = mesh.triangles[f];
      const std::array<Eigen::Vector3d, 3> p{place(t[0]), place(t[1]), place(t[2])};
      sum.normal += (p[1] - p[0]).cross(p[2] - p[0]);
      for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d along = surface_.unit * mesh.normals[t[i]];
        sum.slopes.col(Eigen::Index(Slot(t[i]))) += along.cross(p[(i + 1) % 3] - p[(i + 2) % 3]);
      }
    }
    const double length = sum.normal.norm();
    if (length < kNoLength) return {Eigen::Vector3d::UnitZ(), 0 * sum.slopes};
    sum.normal /= length;
    sum.slopes = (sum.slopes - sum.normal * (sum.normal.transpose() * sum.slopes)).eval() / length;
    return sum;
  }

  const MovingSurface& surface_;
  const Observed& observed_;
  std::uint32_t vertex_;
  std::span<const std::uint32_t> around_;
  std::span<const VertexSample> samples_;
};

}  // namespace

AzimuthResidual ConcaveAzimuth(const AopConstraint& aop, const Eigen::Vector3d& normal) {
  // MakeAopConstraint's vectors: m_s.n and -m_d.n are cosine and sine of (azimuth - AoP) by one length.
  const Eigen::Vector3d by_along = aop.specular.cast<double>(), by_across = -aop.diffuse.cast<double>();
  const double along = by_along.dot(normal), across = by_across.dot(normal);
  const double square = along * along + across * across;
  if (square < 1e-12) return {};
  constexpr double kQuarter = std::numbers::pi / 2;
  double angle = std::atan2(across, along);
  angle -= kQuarter * std::round(angle / kQuarter);
  const double eta = std::abs(angle), fall = std::exp(-kConcave), whole = 1 - fall;
  const double here = std::exp(-kConcave * (1 - 4 * eta / std::numbers::pi));
  const double steepness = kConcave * 4 / std::numbers::pi * here / whole;
  return {std::copysign((here - fall) / whole, angle),
          steepness * (along * by_across - across * by_along) / square};
}

std::unique_ptr<ceres::CostFunction> MakeVertexCost(const MovingSurface& surface, const Observed& observed,
                                                    std::uint32_t vertex) {
  return std::make_unique<VertexCost>(surface, observed, vertex);
}

}  // namespace polarscan
