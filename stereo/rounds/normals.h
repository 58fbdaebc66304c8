// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/image.h"
#include "stereo/costs/problem.h"

namespace polarscan {

struct NormalOptions {
  float sigma = 0.006f;    // a view sees the point if its depth there is within 4 sigma (share of the depth)
  float residual = 0.15f;  // sine of the angle off an AoP constraint at which it counts half
  float agreement = 0.3f;  // of each neighbour's normal
  float depth_normal = 0.6f;  // of the normal of the depth map
  float consensus = 0.6f;     // of the mean of the other views' normals
  float tangent = 0.5f;       // of the depth map's tangents in the least-squares step
  int smoothings = 2;         // over similar neighbours, at the end
};

// Normals (unit, camera frame) of a depth map by planes fitted to log z over 5x5 pixels; pixels across a
// depth edge do not count. Zero where there is no depth.
Image<Eigen::Vector3f> DepthNormals(const Problem& problem, const Image<float>& depth);

// For each pixel with a depth the normal of least robust energy: every view that sees the point contributes
// its AoP, as diffuse or specular reflection, whichever fits (AopConstraint); the four neighbours and the
// depth map pull weakly. Candidates are the pixel's own normal, the depth map's, the mean of the other views'
// and the neighbours', each improved by two re-weighted least-squares steps: so a wrong 90-degree label is
// overruled by better neighbours. Then the normals are smoothed over similar neighbours.
Image<Eigen::Vector3f> SolveNormals(const Problem& problem, const Image<float>& depth,
                                    const Image<Eigen::Vector3f>& start, const NormalOptions& options);

}  // namespace polarscan
