// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "pipeline/stereo/plan.h"
#include "pipeline/stereo/step_runner.h"

namespace polarscan {

// Polarimetric MVS (Cui, Gu, Shi, Tan, Kautz, CVPR 2017), a rival of the paper. Two searches without polarization, the
// second one compares the views' maps, leave the points that several views agree on; then each view by itself fills
// the rest along the contours that its polarization gives (stereo/contours/propagate.h). Filtered maps have the
// pixels that a contour has reached. Throws Cancelled.
void RunPolarimetricMvs(StepRunner& steps);

// The steps of that schedule, none of them marked as done.
std::vector<StereoStep> PolarimetricMvsSteps();

}  // namespace polarscan
