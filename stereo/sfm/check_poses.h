// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "stereo/sfm/colmap/database.h"
#include "stereo/sfm/model/model.h"
#include "stereo/sfm/view_list.h"

namespace polarscan {

// Share of the views that a model must hold to be good; below it (and above the smallest accepted share)
// users are warned.
constexpr double kGoodShare = 0.8;

// Mean error over a model's observations beyond which its focal length is doubted; sound models have 0.3 to
// 0.8 px.
constexpr double kDoubtfulError = 1;

// The names of the views that the model has no image of.
std::vector<std::string> MissingViews(const SparseModel& model, const std::vector<ListedView>& views);

double RegisteredShare(const SparseModel& model, const std::vector<ListedView>& views);

// What is known of the views beside their poses, for the words about those that were not placed.
struct Evidence {
  std::map<std::string, DatabaseImage> images{};   // COLMAP's, by the pictures' names
  std::vector<std::vector<std::string>> pieces{};  // pictures that are in another of COLMAP's models only
  bool masked = false;                             // features outside of the masks were left out
  bool by_board = false;                           // poses are by the board alone
  bool still_background = false;                   // most pairs match in what stands still in the picture
};

// By how many pixels things at the median depth of the views' points move at most between two views: the
// largest focal length * distance of two cameras / depth. None if the model has no points.
std::optional<double> Parallax(const SparseModel& model);

// Whether estimated cameras moved against what they see. Features are good to half a pixel, so with a
// parallax of 2 px at most depths would be wrong by a quarter; the smallest that anybody scans from (one
// degree) has ten times as much. Less, or no points at all, comes from pictures of one place, or of a
// background that stands still.
bool HasMoved(const SparseModel& model);

// Says what is wrong with estimated poses, in words that help: throws Error if the share of registered views
// is below `smallest_share` (or fewer than two are registered) or the cameras hardly moved, warns
// of all missing views by name and cause; warns of cameras that cannot be right. `log` is COLMAP's.
void CheckEstimatedPoses(const SparseModel& model, const std::vector<ListedView>& views,
                         const Evidence& evidence, double smallest_share, const std::string& log,
                         Progress& progress);

// The same for known poses, of which the missing ones are known (known_poses.h): throws Error if all cameras
// stand at one place or a focal length is absurd, warns of cameras that cannot be right and of poses that
// seem to be written by another convention. `where` names the given model; adjusted: by bundle adjustment.
void CheckKnownPoses(const SparseModel& model, const std::string& where, bool adjusted, Progress& progress);

// Mean reprojection error over the observations of all points, 0 without points.
double MeanError(const SparseModel& model);

}  // namespace polarscan
