// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "core/progress.h"
#include "stereo/sfm/model/model.h"
#include "stereo/workspace.h"

namespace polarscan {

// Masks for a workspace that has none, into its masks/: of all views, or of none.
struct FoundMasks {
  enum Background { kNone, kPlain, kStill } background = kNone;
  std::size_t views = 0;  // that have one now; 0: none is made
  std::string why_not;    // in words, where a background looked plain or still all the same; else empty
};

// Makes them where the background is plain in nearly all pictures (plain_background.h), or stands still in them
// (still_background.h), and what stands out of it is one object, sharply: its outlines are steps of the light nearly everywhere, and hardly any of its
// pixels sees no place that the other masks allow (mask_fit.h). Sets the views' depth ranges by them.
FoundMasks FindMasks(const SparseModel& model, Workspace& workspace, Progress& progress);

// In words, for people; empty if no background looked plain or still.
std::string FoundMasksWords(const FoundMasks& found);

}  // namespace polarscan
