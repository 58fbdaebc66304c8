// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stereo/polarpms/options.h"
#include "stereo/workspace.h"

namespace polarscan {

// Of all views, px: what stereo estimates, inside the masks where they count.
double ObjectPixels(const Workspace& workspace, const StereoOptions& options);

// How many picture sizes, each half the next one, the multi-level schedule works at: as many as
// options.levels allows while the coarsest pictures still show enough of the object (5,000 pixels a view) and
// its thin parts (30 px wide on the mean, nearly three matching windows: what a search loses there no finer
// size finds again, docs/polarpms.md). Without masks only the pixels count.
int Levels(const Workspace& workspace, const StereoOptions& options);

}  // namespace polarscan
