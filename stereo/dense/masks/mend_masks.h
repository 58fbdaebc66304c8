// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "core/progress.h"
#include "stereo/workspace.h"

namespace polarscan {

// What was wrong with a workspace's masks, and is mended in its masks/.
struct MaskMending {
  double outside_px = 0;  // so far outside of the masks' outlines the light changed; negative: inside
  std::vector<std::string> gaps, surplus;  // views whose masks lacked a piece, or held one too many

  bool Any() const { return outside_px != 0 || !gaps.empty() || !surplus.empty(); }
};

// Looks for two kinds of errors, and mends them where the pictures bear them out:
// - Masks that are too wide or too narrow as a whole: along their outlines, of all views, the largest step of the light
//   lies at the same distance, at most a fortieth of the object's size. Outlines are moved there, then to the steps
//   themselves (outline_cut.h).
// - A mask that lacks a piece that all others show to be the object, or holds one that they exclude (hull_votes.h), where
//   the light does not change at the piece's border with the rest. 16 masks at least; pieces of about a thirtieth of the
//   object's size or more.
// Needs the views' depth ranges. Leaves masks that are right as they are.
MaskMending MendMasks(const Workspace& workspace, Progress& progress);

// In words, for people; empty if nothing was wrong.
std::string MaskMendingWords(const MaskMending& mending);

}  // namespace polarscan
