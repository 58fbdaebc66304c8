// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/image.h"
#include "stereo/costs/problem.h"

namespace polarscan {

// Which reflection made a pixel's polarization: the azimuth is the AoP (diffuse) or 90 degrees from it (specular).
enum class Reflection : std::uint8_t { kDiffuse, kSpecular };

struct LabelOptions {
  float smoothness = 1;   // of neighbours whose azimuths agree, beside a normal that agrees with a label
  float diffuse = 0.02f;  // preferred by so much where nothing else tells
  int sweeps = 12;        // there and back
};

// Resolves the 90-degree ambiguity of a view's AoP by a graph (Cui et al., CVPR 2017): each active pixel takes the
// label of least
//   sum w r(label) + smoothness sum w_pq sin^2(azimuth_p - azimuth_q)
// with r the share of the normal's tilt that does not fit the label (AopConstraint), so that a normal that faces the
// camera says little; w: the AoP's weight; w_pq: the smaller one of both. Minimised by sequential tree-reweighted
// message passing (TRW-S: Kolmogorov, PAMI 2006), as links between pixels whose AoP differ by more than 45 degrees ask
// for different labels. normals: unit, camera frame, zero where none is known.
Image<Reflection> LabelReflection(const Problem& problem, const Image<Eigen::Vector3f>& normals,
                                  const LabelOptions& options);

}  // namespace polarscan
