// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stereo/options.h"
#include "stereo/workspace.h"

namespace polarscan {

// Of all views, px: what stereo estimates, inside the masks where they count.
double ObjectPixels(const Workspace& workspace, const StereoOptions& options);

// The picture sizes of the multi-level schedule, each half the next one.
struct Levels {
  int count = 1;
  bool match_coarsest = false;  // it is the full size, and shows enough to match surfaces there
};

// As many as options.levels allows while the coarsest pictures still show enough of the object (5,000 pixels
// a view) and its thin parts (30 px wide on the mean, nearly three matching windows: what a search loses
// there no finer size finds again, docs/notes/thin-parts.md). Without masks they are taken to be a quarter of
// the picture's shorter side wide. More than three only while the coarsest pictures' (or their cuts' to the
// object) longer side is 300 px or more: windows of a few pixels see nothing but noise in larger ones.
Levels ChooseLevels(const Workspace& workspace, const StereoOptions& options);

}  // namespace polarscan
