// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "stereo/sfm/model/model.h"
#include "stereo/sfm/view_list.h"

namespace polarscan {

// The part of a given model that belongs to the views, whose names are those of its images: with or without
// folders and extensions, which need not be the pictures'. Images are renamed NAME.png; cameras are scaled to
// the views' size (a view of width 0 has none yet: its camera stays); points that no view sees are dropped.
// `where` names the model in messages. Throws Error, with examples of both names, if fewer than two views
// have a pose; if a view has two; if a camera cannot be the views'.
SparseModel SelectKnownPoses(const SparseModel& given, const std::vector<ListedView>& views,
                             const std::string& where);

// How many of the views, by name, the model has a pose for; one that it has two for counts.
std::size_t CountKnownPoses(const SparseModel& given, const std::vector<std::string>& views);

// Reads the model in `folder` and selects. Warns of views without a pose, by name, of what is odd in the
// files, and of cameras that were given for another size.
SparseModel ReadKnownPoses(const std::filesystem::path& folder, const std::vector<ListedView>& views,
                           Progress& progress);

}  // namespace polarscan
