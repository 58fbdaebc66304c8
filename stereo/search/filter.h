// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "stereo/costs/problem.h"
#include "stereo/options.h"

namespace polarscan {

// Sets depth and normal to 0 where the estimate is unreliable (section 3.4):
// - eq. (11): the pixel has neither enough polarization (DoP >= rho_t) nor enough texture (variance of its
//   patch >= lambda_t, in squared 8-bit levels). The paper's prose admits "and" and "or"; "and" would delete
//   every texture-less pixel, so one of the two is enough. Without polarization only texture counts.
// - then as COLMAP: fewer than filter_min_consistent sources see it at enough triangulation angle, from the
//   front, with enough probability and, in the geometric pass, with a small forward-backward error.
// selection: for each pixel and source, source fastest, how likely it sees the point; empty: all do.
void FilterEstimates(const Problem& problem, const StereoOptions& options,
                     const std::vector<float>& selection, DepthNormalMap& map);

// The same after a round across views, which has counted the support already (vote.h): keeps pixels with a
// cue and a confidence of filter_min_support or more. Where photographs are all there is, without
// polarization and masks, filter_min_consistent sources must also see it as above and match by
// filter_min_ncc.
void FilterBySupport(const Problem& problem, const StereoOptions& options, const Image<float>& confidence,
                     DepthNormalMap& map);

}  // namespace polarscan
