// SPDX-License-Identifier: Apache-2.0
#include "stereo/costs/hypotheses.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace polarscan {

Random PixelRandom(const Problem& problem, int seed, int x, int y, int turn) {
  const auto pixel = std::uint64_t(y) * std::uint64_t(problem.reference->gray.width()) + std::uint64_t(x);
  return Random(std::uint64_t(seed), std::uint64_t(problem.view_index), pixel, std::uint64_t(turn));
}

Eigen::Vector3f RandomNormal(const Eigen::Vector3f& ray, Random& random) {
  const float z = random.Uniform(-1, 1), angle = random.Uniform(0, 2 * std::numbers::pi_v<float>);
  const float radius = std::sqrt(std::max(0.0f, 1 - z * z));
  const Eigen::Vector3f normal(radius * std::cos(angle), radius * std::sin(angle), z);
  return normal.dot(ray) > 0 ? Eigen::Vector3f(-normal) : normal;
}

Eigen::Vector3f PerturbedNormal(const Eigen::Vector3f& normal, const Eigen::Vector3f& ray,
                                float max_angle_rad, Random& random) {
  for (int attempt = 0; attempt < 4; ++attempt, max_angle_rad /= 2) {
    const float a = random.Uniform(-max_angle_rad, max_angle_rad),
                b = random.Uniform(-max_angle_rad, max_angle_rad),
                c = random.Uniform(-max_angle_rad, max_angle_rad);
    const Eigen::Matrix3f turn =
        (Eigen::AngleAxisf(a, Eigen::Vector3f::UnitX()) * Eigen::AngleAxisf(b, Eigen::Vector3f::UnitY()) *
         Eigen::AngleAxisf(c, Eigen::Vector3f::UnitZ()))
            .toRotationMatrix();
    const Eigen::Vector3f turned = (turn * normal).normalized();
    if (turned.dot(ray) < 0) return turned;
  }
  return normal;
}

AopConstraint MakeAopConstraint(const PolarSample& sample, float x, float y) {
  const float c = sample.cos_phi, s = sample.sin_phi;
  return {{s, c, -(x * s + y * c)}, {c, -s, -(x * c - y * s)}, sample.weight};
}

AopConstraint MakeAopConstraint(const Source& source, const PolarSample& sample, const Seen& seen) {
  AopConstraint constraint = MakeAopConstraint(sample, seen.x, seen.y);
  constraint.diffuse = source.rotation.transpose() * constraint.diffuse;
  constraint.specular = source.rotation.transpose() * constraint.specular;
  return constraint;
}

Eigen::Vector3f NormalFromAop(std::span<const AopConstraint> constraints, AopLabels labels,
                              const Eigen::Vector3f& start, const Eigen::Vector3f& ray) {
  constexpr int kRounds = 2;
  Eigen::Vector3f normal = start;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3f sum = Eigen::Matrix3f::Zero();
    for (const AopConstraint& constraint : constraints) {
      bool diffuse = std::abs(constraint.diffuse.dot(normal)) < std::abs(constraint.specular.dot(normal));
      if (round == 0 && labels != AopLabels::kFromNormal) diffuse = labels == AopLabels::kAllDiffuse;
      const Eigen::Vector3f& m = diffuse ? constraint.diffuse : constraint.specular;
      sum += constraint.weight * m * m.transpose();
    }
    const float trace = sum.trace();
    if (!(trace > 1e-6f)) return start;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
    solver.computeDirect(sum / trace);
    if (solver.eigenvalues()[1] < 1e-4f) return start;  // fewer than two independent constraints
    normal = solver.eigenvectors().col(0);
    if (normal.dot(ray) > 0) normal = -normal;
  }
  return normal.allFinite() && normal.dot(ray) < -0.02f * ray.norm() ? normal.normalized() : start;
}

}  // namespace polarscan
