// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "pipeline/stereo/step_runner.h"

namespace polarscan {

// The published schedule: a photometric pass over all views (F_pho + F_pol + F_dep), then a geometric pass
// that starts from those maps, adds F_geo and filters. Without geometric iterations the photometric maps are
// the result.
void RunSequential(StepRunner& steps);

}  // namespace polarscan
