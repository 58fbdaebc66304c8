// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/mesh.h"
#include "fusion/mesh_topology.h"
#include "fusion/surface/inverse_rendering/shading.h"
#include "fusion/surface/inverse_rendering/vertex_samples.h"

namespace ceres {
class CostFunction;
}

namespace polarscan {

// What stays as it is while vertices move: vertex v lies at vertices[v] + x_v unit normals[v].
struct MovingSurface {
  const TriangleMesh& mesh;
  const VertexNeighbours& neighbours;
  double unit = 1;  // world units of a move of 1
};

// What the views say of a moving surface.
struct Observed {
  const VertexSamples& samples;          // with intensities in units of their mean
  const std::vector<Harmonics>& lights;  // by view
  double photometric = 1;                // weights of the two terms
  double polarimetric = 1;
};

// How far a normal's azimuth is off the four that an AoP allows (0, 90, 180, 270 degrees from it).
struct AzimuthResidual {
  double value = 0;                                 // -1 to 1; 0: it is one of them, +-1: 45 degrees off
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();  // by the normal (of any length, world frame)
};

// (exp(-k theta) - exp(-k)) / (1 - exp(-k)), theta = 1 - 4 eta / pi, k = 0.5, with the sign of the angle: the
// "concave-shaped" function of Polarimetric MVIR, as its square root would have a kink where it matters. eta:
// angle between the normal's perspective azimuth and the nearest of the four. 0 for a normal along the line
// of sight.
AzimuthResidual ConcaveAzimuth(const AopConstraint& aop, const Eigen::Vector3d& normal);

// The photometric and the polarimetric term of one vertex X of V views, as 2 V residuals whose squares add up
// to
//   1/V sum_c photometric (K S_c(n) - I_c)^2 + polarimetric g_c ConcaveAzimuth_c(n)^2.
// n: the vertex' normal, area-weighted; S_c: shading of view c; I_c, g_c and the AoP: as sampled, wherever
// it moves. Parameters, each one number: the vertex' move, its neighbours' in their order, its albedo. The
// arguments must last as long. Derivatives in closed form.
std::unique_ptr<ceres::CostFunction> MakeVertexCost(const MovingSurface& surface, const Observed& observed,
                                                    std::uint32_t vertex);

}  // namespace polarscan
