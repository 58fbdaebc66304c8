// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <span>

#include "core/random.h"
#include "stereo/costs/problem.h"

namespace polarscan {

// The random numbers of one pixel's turn: a function of the seed, the view, the pixel and the turn.
Random PixelRandom(const Problem& problem, int seed, int x, int y, int turn);

// Uniform over the directions that face a camera looking along `ray`.
Eigen::Vector3f RandomNormal(const Eigen::Vector3f& ray, Random& random);

// The normal turned about the three axes by angles uniform in +-max_angle_rad (COLMAP); halved up to three
// times while the result turns away from the camera, else unchanged.
Eigen::Vector3f PerturbedNormal(const Eigen::Vector3f& normal, const Eigen::Vector3f& ray,
                                float max_angle_rad, Random& random);

// What one view's AoP says about a normal: it is perpendicular to `diffuse` or to `specular` (reference
// frame). In the view's own frame, at normalised pixel (x, y) with AoP phi:
//   diffuse  m_d = (sin phi, cos phi, -(x sin phi + y cos phi)),
//   specular m_s = (cos phi, -sin phi, -(x cos phi - y sin phi)),
// from azimuth (n_x - n_z x, n_y - n_z y) in image axes and field direction (cos phi, -sin phi).
struct AopConstraint {
  Eigen::Vector3f diffuse, specular;
  float weight = 0;
};
AopConstraint MakeAopConstraint(const PolarSample& sample, float x, float y);

// What a source's sample says, in the reference frame.
AopConstraint MakeAopConstraint(const Source& source, const PolarSample& sample, const Seen& seen);

enum class AopLabels { kFromNormal, kAllDiffuse, kAllSpecular };

// The unit normal that fits the constraints best in the least-squares sense: the smallest eigenvector of
// sum w m m^T with m the diffuse or the specular vector, first as `labels` says, then whichever fits the
// normal found better. Returns `start` if the constraints do not fix a normal that faces the camera.
Eigen::Vector3f NormalFromAop(std::span<const AopConstraint> constraints, AopLabels labels,
                              const Eigen::Vector3f& start, const Eigen::Vector3f& ray);

}  // namespace polarscan
