// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "pipeline/stereo/plan.h"
#include "pipeline/stereo/step_runner.h"

namespace polarscan {

// ACMMP (Xu, Kong, Tao, Pollefeys, TPAMI 2022), a rival of the paper, without polarization. From the coarsest
// picture size to the finest: a photometric search with a planar prior, then two searches that compare the
// views' maps. At finer sizes the search starts from the enlarged maps; its details come from a search of its
// own where that matches better (detail restorer). Throws Cancelled.
void RunAcmmp(StepRunner& steps);

// The steps of that schedule, none of them marked as done.
std::vector<StereoStep> AcmmpSteps(const Workspace& workspace, const StereoOptions& options);

}  // namespace polarscan
