// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <string>
#include <vector>

#include "core/progress.h"
#include "stereo/sfm/database.h"
#include "stereo/sfm/model.h"
#include "stereo/sfm/view_list.h"

namespace polarscan {

// Share of the views that a model must hold to be good; below it (and above the smallest accepted share)
// users are warned.
constexpr double kGoodShare = 0.8;

// Mean error over a model's observations beyond which its focal length is doubted; sound models have 0.3 to
// 0.8 px.
constexpr double kDoubtfulError = 1;

double RegisteredShare(const SparseModel& model, const std::vector<View>& views);

// Says what is wrong with estimated poses, in words that help: throws Error if the share of registered views
// is below `smallest_share` (or fewer than two are registered), warns below kGoodShare and of any missing
// view by name and cause; warns of cameras that cannot be right. `log` is COLMAP's.
void JudgePoses(const SparseModel& model, const std::vector<View>& views,
                const std::map<std::string, DatabaseImage>& database, double smallest_share,
                const std::string& log, Progress& progress);

// Mean reprojection error over the observations of all points, 0 without points.
double MeanError(const SparseModel& model);

}  // namespace polarscan
