// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"
#include "fusion/surface/surface_views.h"
#include "stereo/costs/hypotheses.h"

namespace polarscan {

// What one view shows where a vertex is.
struct VertexSample {
  int view = 0;         // index into SurfaceViews::views
  float intensity = 0;  // S0, linear in light; LookAt: of the pictures' scale
  // The AoP as the two directions that the normal is perpendicular to, diffuse or specular; world frame.
  // Weight: g of the DoP (docs/polarpms.md, eq. (9)); 0 where there is no polarization.
  AopConstraint aop{Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero(), 0};
};

// The samples of all vertices, those of one after the other, by view.
class VertexSamples {
 public:
  using Seen = std::pair<std::uint32_t, VertexSample>;  // a vertex and what a view shows there

  VertexSamples() = default;
  // seen: by view, the vertices that it sees.
  VertexSamples(std::size_t vertices, const std::vector<std::vector<Seen>>& seen);

  std::span<const VertexSample> Of(std::size_t vertex) const {
    return std::span(samples_).subspan(begin_[vertex], begin_[vertex + 1] - begin_[vertex]);
  }
  std::size_t size() const { return samples_.size(); }
  double MeanIntensity() const;
  void ScaleIntensities(double by);

 private:
  std::vector<std::size_t> begin_;
  std::vector<VertexSample> samples_;
};

// Samples each vertex in all views that see it (VisibleVertices, fusion/surface/refinement/mesh_views.h);
// bilinear, and where there is a mask from pixels inside of it only. dop_saturation: rho_0 of the weight;
// polarized: whether AoP are wanted. Reads each view once, as many at a time as there are threads. The same
// for any number of threads.
VertexSamples LookAt(const TriangleMesh& mesh, const SurfaceViews& views, bool polarized,
                     double dop_saturation, Progress& progress);

}  // namespace polarscan
