// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/inverse_rendering/shading.h"

#include <Eigen/Cholesky>

#include "core/parallel.h"

namespace polarscan {
namespace {

constexpr double kRidge = 1e-6;  // of the mean diagonal

using LightMatrix = Eigen::Matrix<double, 9, 9>;

// The sums of least squares of one view.
struct LightSystem {
  LightMatrix matrix = LightMatrix::Zero();
  Harmonics right = Harmonics::Zero();
};

Harmonics Solved(LightSystem system) {
  const double mean = system.matrix.trace() / 9;
  if (mean <= 0) return Harmonics::Zero();
  system.matrix.diagonal().array() += kRidge * mean;
  return system.matrix.ldlt().solve(system.right);
}

}  // namespace

Harmonics HarmonicsAt(const Eigen::Vector3d& n) {
  const double x = n.x(), y = n.y(), z = n.z();
  Harmonics h;
  h << 1, y, z, x, x * y, y * z, z * z - 1.0 / 3, x * z, x * x - y * y;
  return h;
}

Eigen::Matrix<double, 9, 3> HarmonicSlopes(const Eigen::Vector3d& n) {
  const double x = n.x(), y = n.y(), z = n.z();
  Eigen::Matrix<double, 9, 3> slopes;
  slopes << 0, 0, 0,  //
      0, 1, 0,        //
      0, 0, 1,        //
      1, 0, 0,        //
      y, x, 0,        //
      0, z, y,        //
      0, 0, 2 * z,    //
      z, 0, x,        //
      2 * x, -2 * y, 0;
  return slopes;
}

std::vector<Harmonics> FitLights(const std::vector<Eigen::Vector3d>& normals,
                                 const std::vector<double>& albedo, const VertexSamples& samples,
                                 std::size_t views) {
  std::vector<Harmonics> lights(views);
  ParallelFor(0, int(views), [&](int view) {
    LightSystem system;
    for (std::size_t v = 0; v < normals.size(); ++v) {
      const auto of_vertex = samples.Of(v);
      const Harmonics shading = albedo[v] * HarmonicsAt(normals[v]);
      for (const VertexSample& sample : of_vertex) {
        if (sample.view != view) continue;
        const double share = 1 / double(of_vertex.size());
        system.matrix += share * shading * shading.transpose();
        system.right += share * double(sample.intensity) * shading;
      }
    }
    lights[std::size_t(view)] = Solved(system);
  });
  return lights;
}

}  // namespace polarscan
