// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "core/progress.h"
#include "stereo/costs/problem.h"
#include "stereo/options.h"

namespace polarscan {

// ACMH (Xu and Tao, CVPR 2019) with what ACMMP adds (Xu, Kong, Tao, Pollefeys, TPAMI 2022): red-black
// PatchMatch; of each of eight zones the cheapest pixel's hypothesis; sources chosen by what all eight say of
// them; a planar prior.

// Estimates with what they cost, both of one view's size.
struct CostedMap {
  DepthNormalMap map;
  Image<float> cost;
};

struct AcmhPass {
  int iterations = 3;
  int first_iteration = 0;  // key of the random numbers
  const DepthNormalMap* prior =
      nullptr;  // planes to stay near to (stereo/search/planar_prior.h); depth 0: none
};

// What each active pixel's estimate costs: the mean over its four best sources of 1 - NCC and, if the sources
// have maps, of the geometric term. Pixels without an estimate get a random one.
CostedMap StartAcmh(const Problem& problem, const StereoOptions& options, DepthNormalMap map,
                    const Progress& progress);

// Improves `state`, which StartAcmh or an earlier pass made. Throws Cancelled.
void RunAcmh(const Problem& problem, const StereoOptions& options, const AcmhPass& pass, CostedMap& state,
             const Progress& progress);

}  // namespace polarscan
