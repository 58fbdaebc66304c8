// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/camera.h"
#include "core/image.h"
#include "stereo/costs/stereo_view.h"

namespace polarscan {

struct IntegrationOptions {
  float data_weight = 0.002f;  // lambda: of the voted depth beside the slopes, for one supporting view
  float max_confidence = 4;    // views beyond that do not count more
  float normal_jump = 0.15f;   // difference of neighbouring normals at which a link counts half
  int iterations = 80;         // of conjugate gradients, at most
  double tolerance = 1e-4;     // they end when the residual has fallen to this share of the voted depth's
};

// Depth from normals: minimises over w = log z
//   sum lambda min(c, c_max) (w - w0)^2 + sum g_ij (w_j - w_i - p_ij)^2
// over pixels and right and lower neighbours, by Jacobi-preconditioned conjugate gradients. In perspective
// the slope of log z along x is p = -n_x / (f n . ray), exactly; p_ij is the mean of both pixels'. g_ij falls
// where depth or normals jump. w0: log of the voted depth; c: its confidence. The result has the same pixels.
// start: a depth map near the solution, or the voted one.
Image<float> IntegrateNormals(const Pinhole& camera, const Image<float>& depth,
                              const Image<float>& confidence, const Image<Eigen::Vector3f>& normals,
                              const Image<float>& start, const IntegrationOptions& options);

}  // namespace polarscan
