// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "core/mesh.h"
#include "core/progress.h"
#include "stereo/costs/normal_from_aop.h"
#include "stereo/dense_view.h"

namespace polarscan {

// Which vertices each view sees, [view][vertex]: inside of its picture, facing it by more than a tenth of
// their direction, and nothing of the mesh in between.
std::vector<std::vector<bool>> VisibleVertices(const TriangleMesh& mesh, const std::vector<DenseView>& views,
                                               Progress& progress);

// What the AoP of all views says about each vertex's normal, world frame (AopConstraint,
// stereo/costs/hypotheses.h). 14 bytes for each view that sees a vertex, of at most kMost; of more those
// of the largest weight are kept.
class VertexConstraints {
 public:
  static constexpr std::size_t kMost = 48;

  // Room for what these views see (VisibleVertices).
  VertexConstraints(std::size_t vertices, const std::vector<std::vector<bool>>& visible);

  // Each vertex from one thread.
  void Add(std::size_t vertex, const AopConstraint& constraint);

  std::size_t CountOf(std::size_t vertex) const { return count_[vertex]; }
  AopTable TableOf(std::size_t vertex) const;

 private:
  struct Packed {
    std::array<std::int16_t, 3> diffuse, specular;
    std::uint16_t weight;
  };
  std::vector<std::size_t> begin_;
  std::vector<std::uint8_t> count_;
  std::vector<Packed> packed_;
};

// One view's sample at image point (u, v), interpolated; weight 0 outside of the picture.
PolarSample SamplePolar(const Image<PolarSample>& polar, double u, double v);

// Adds one view's constraints; `visible`: one of VisibleVertices. The AoP is interpolated between pixels as
// S1 and S2 are, not as an angle.
void AddAopConstraints(const TriangleMesh& mesh, const DenseView& view, const Image<PolarSample>& polar,
                       const std::vector<bool>& visible, VertexConstraints& constraints);

}  // namespace polarscan
