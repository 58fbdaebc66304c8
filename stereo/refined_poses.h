// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "stereo/workspace.h"

namespace polarscan {

// Poses of some views; the others keep theirs.
using PosesByName = std::map<std::string, Rigid>;

// stereo/poses.json: poses that fit the surface better than those of views.json, from which they came.
struct RefinedPoses {
  std::string inputs;             // a hash of what they were found from
  PosesByName start;              // with which stereo began anew, because those given were far off
  std::vector<PosesByName> fits;  // to the surfaces, one after the other
  double median_px = 0;           // how far the first fit moved the surface in the pictures
  double worst_px = 0;
  std::string worst;  // the view that moved so far

  bool Any() const {
    return !start.empty() || std::ranges::any_of(fits, [](const PosesByName& fit) { return !fit.empty(); });
  }
};

// None if there is no such file, or views.json is another one by now. Throws Error if it is damaged.
std::optional<RefinedPoses> ReadRefinedPoses(const std::filesystem::path& dense);
void WriteRefinedPoses(const std::filesystem::path& dense, const RefinedPoses& refined);
void RemoveRefinedPoses(const std::filesystem::path& dense);

// With the poses after so many fits, or after all of them.
Workspace WithPoses(Workspace workspace, const RefinedPoses& refined, std::size_t fits);
Workspace WithPoses(Workspace workspace, const RefinedPoses& refined);

}  // namespace polarscan
