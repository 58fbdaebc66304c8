// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stereo/costs/stereo_view.h"
#include "stereo/workspace.h"

namespace polarscan {

// The grey value's scale: the largest 99.5th percentile of S0 among at most 16 views.
float GrayScale(const Workspace& workspace);

// Whether the set's AoP say anything: of the pixels of at most eight views, inside the masks where they
// count, one in a hundred is surer than half. Of noise none is: with the usual aop_noise_deg its weight would
// need a DoP of seven times the noise.
bool AopIsInformative(const Workspace& workspace, bool masks,
                      double aop_noise_deg = StereoOptions().aop_noise_deg);

// The view as the matcher needs it, its size halved so often (MakeStereoView).
StereoView LoadStereoView(const Workspace& workspace, int view, float gray_scale,
                          const StereoOptions& options, int halvings = 0);

}  // namespace polarscan
