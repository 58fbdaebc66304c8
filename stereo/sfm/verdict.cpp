// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"
#include "stereo/sfm/camera_models.h"

namespace polarscan {
namespace {

constexpr const char* kCures =
    "Usual causes are too little overlap (neighbours should share 75 %), blur, changes of exposure, and "
    "objects without "
    "texture. Take more pictures, put a printed sheet under the object, lengthen the depth of field, or give "
    "known "
    "poses (sparse/)";

std::vector<std::string> MissingViews(const SparseModel& model, const std::vector<View>& views) {
  std::set<std::string> registered;
  for (const auto& [id, image] : model.images) registered.insert(image.name);
  std::vector<std::string> missing;
  for (const View& view : views)
    if (!registered.contains(view.PictureName())) missing.push_back(view.name);
  return missing;
}

// "no features in a, b; no match with any other view for c; too few matches for d".
std::string Causes(const std::vector<std::string>& missing,
                   const std::map<std::string, DatabaseImage>& database) {
  std::vector<std::string> blank, lonely, weak, parts;
  for (const std::string& name : missing) {
    const auto image = database.find(name + ".png");
    const bool known = image != database.end();
    (known && image->second.keypoints == 0  ? blank
     : known && image->second.partners == 0 ? lonely
                                            : weak)
        .push_back(name);
  }
  if (!blank.empty()) parts.push_back("no features in " + Enumerate(blank));
  if (!lonely.empty()) parts.push_back("no match with any other view for " + Enumerate(lonely));
  if (!weak.empty()) parts.push_back("too few matches for " + Enumerate(weak));
  return fmt::format("{}", fmt::join(parts, "; "));
}

void JudgeCameras(const SparseModel& model, const std::string& log, Progress& progress) {
  const double error = MeanError(model);
  if (error > kDoubtfulError)
    progress.Warn(
        fmt::format("the poses are doubtful: the points miss their features by {:.1f} px on average (good is "
                    "below 1). Try another camera model, or give the focal length ({})",
                    error, log));
  for (const auto& [id, camera] : model.cameras) {
    const Pinhole lens = ToLens(camera).pinhole;
    const double ratio = lens.fx / lens.fy, field_deg = 2 * std::atan2(lens.width, 2 * lens.fx) * 180 / M_PI;
    if (ratio < 0.9 || ratio > 1.1 || field_deg < 2 || field_deg > 140)
      progress.Warn(
          fmt::format("the camera is doubtful: focal lengths {:.0f} and {:.0f} px, field of view {:.0f} "
                      "degrees. Try the camera model SIMPLE_RADIAL, or give the focal length",
                      lens.fx, lens.fy, field_deg));
  }
}

}  // namespace

double RegisteredShare(const SparseModel& model, const std::vector<View>& views) {
  return 1.0 - double(MissingViews(model, views).size()) / double(views.size());
}

double MeanError(const SparseModel& model) {
  double sum = 0, count = 0;
  for (const auto& [id, point] : model.points) {
    sum += point.error_px * double(point.track.size());
    count += double(point.track.size());
  }
  return count > 0 ? sum / count : 0;
}

void JudgePoses(const SparseModel& model, const std::vector<View>& views,
                const std::map<std::string, DatabaseImage>& database, double smallest_share,
                const std::string& log, Progress& progress) {
  const std::vector<std::string> missing = MissingViews(model, views);
  const std::size_t registered = views.size() - missing.size();
  const double share = double(registered) / double(views.size());
  if (share < smallest_share || registered < 2)
    throw Error(fmt::format("only {} of {} views could be placed ({})", registered, views.size(),
                            Causes(missing, database)),
                log, kCures);
  if (share < kGoodShare)
    progress.Warn(fmt::format("only {} of {} views could be placed ({}). {}", registered, views.size(),
                              Causes(missing, database), kCures));
  else if (!missing.empty())
    progress.Warn(fmt::format("{} of {} views could not be placed and are left out: {}", missing.size(),
                              views.size(), Causes(missing, database)));
  JudgeCameras(model, log, progress);
}

}  // namespace polarscan
