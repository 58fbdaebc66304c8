// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/image.h"
#include "stereo/costs/problem.h"

namespace polarscan {

// Depth and how many views (weighted by their angle of incidence, the view itself among them) support it.
struct Vote {
  Image<float> depth, confidence;
};

struct VoteOptions {
  float sigma = 0.006f;      // kernel, as a share of the depth
  float min_support = 0.3f;  // of the best mode's support, for a nearer mode to win
  float trust =
      0;  // a nearer mode also wins with this many times the weight of those that see through it; 0: no
};

// Every view's map confronted with the others: the sources' surfaces are drawn into the reference view (each
// pixel as a small piece of its plane, the nearest piece wins), and each pixel takes the nearest depth that
// has enough support, by mean shift. A thin part in front of a large surface so keeps its place. So does a
// plain part in front of a textured surface: the surface behind it is no witness against it, only views that
// see through it are (`trust`). Pixels without any estimate stay 0. The sources' maps must be there.
Vote VoteForDepth(const Problem& problem, const DepthNormalMap& own, const VoteOptions& options);

// How many views, weighted by their angle of incidence only, support these depths by their maps (`own` is the
// view's); the same kernel.
Image<float> SupportOf(const Image<float>& depth, const Problem& problem, const DepthNormalMap& own,
                       float sigma);

}  // namespace polarscan
