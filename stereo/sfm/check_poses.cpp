// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/check_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"
#include "core/statistics.h"
#include "stereo/sfm/model/camera_models.h"
#include "stereo/sfm/pose_conventions.h"
#include "stereo/workspace.h"

namespace polarscan {
namespace {

constexpr const char* kCures =
    "Usual causes are too little overlap (neighbours should share 75 %), blur, changes of exposure, and "
    "objects without texture. Take more pictures, put a printed sheet under the object, lengthen the depth "
    "of field, or give known poses (sparse/)";
constexpr const char* kPieceCures =
    "Take pictures that lead from one part to the other (neighbours should share 75 %), or scan each part by "
    "itself";
constexpr const char* kStillCures =
    "Usually the background, or a label on the lens, stands still in the pictures while the object turns, or "
    "all pictures are from one place. Give masks of the object (masks/NAME.png; with --sfm-masks yes only "
    "features inside of them count), lay something with texture or a printed board (polarscan board) under "
    "it that "
    "turns along, cover the background with something plain, or move the camera instead of the object";
constexpr const char* kBoardCures =
    "Show more of the board in these pictures, sharp and lit; --poses-from features takes the pictures' "
    "features instead";
constexpr double kLeastParallaxPx = 2;
constexpr double kWidestDeg = 165;  // that a pinhole camera could see at all
constexpr int kEnoughWithOne = 60;  // with one view: the mapper asks for 30 of them that it has points for

std::set<std::string> PicturesOf(const SparseModel& model) {
  std::set<std::string> names;
  for (const auto& [id, image] : model.images) names.insert(image.name);
  return names;
}

// The most matches that one of the pictures `from` has with one of `to`.
struct Link {
  int matches = 0;
  std::string from{}, to{};
};
Link BestLink(const std::set<std::string>& from, const std::set<std::string>& to, const Evidence& evidence) {
  Link best;
  for (const std::string& name : from) {
    const auto image = evidence.images.find(name);
    if (image == evidence.images.end()) continue;
    for (const auto& [partner, matches] : image->second.partners)
      if (to.contains(partner) && matches > best.matches) best = {matches, ViewName(name), ViewName(partner)};
  }
  return best;
}

// "b0 to b6 hang together but not with the rest (at most 20 matches, of b0 with a7)", for COLMAP's other
// models. Takes the views out of `missing`.
std::vector<std::string> PieceWords(std::vector<std::string>& missing, const std::set<std::string>& placed,
                                    const std::vector<ListedView>& views, const Evidence& evidence) {
  std::vector<std::string> words;
  for (const std::vector<std::string>& piece : evidence.pieces) {
    const std::set<std::string> pictures(piece.begin(), piece.end());
    const auto here = std::stable_partition(missing.begin(), missing.end(), [&](const std::string& name) {
      return !pictures.contains(name + ".png");
    });
    if (std::distance(here, missing.end()) < 2) continue;
    const Link link = BestLink(pictures, placed, evidence);
    words.push_back(fmt::format(
        "{} hang together but not with the rest ({})", EnumerateRuns({here, missing.end()}, views),
        link.matches == 0
            ? "no matches between them"
            : fmt::format("at most {} matches, of {} with {}", link.matches, link.from, link.to)));
    missing.erase(here, missing.end());
  }
  return words;
}

// Why each of the views is missing: "no features in a, b; no match with any other view for c; ...".
std::string Causes(std::vector<std::string> missing, const SparseModel& model,
                   const std::vector<ListedView>& views, const Evidence& evidence) {
  if (evidence.by_board && !missing.empty())
    return "fewer than eight corners of the board in " + EnumerateRuns(missing, views);
  const std::set<std::string> placed = PicturesOf(model);
  std::vector<std::string> parts = PieceWords(missing, placed, views, evidence);
  std::set<std::string> all;  // where nothing is placed, matches with any view count
  for (const auto& [name, image] : evidence.images) all.insert(name);
  std::vector<std::string> blank, lonely, apart, weak, odd;
  int most_weak = 0;
  for (const std::string& name : missing) {
    const auto image = evidence.images.find(name + ".png");
    const bool known = image != evidence.images.end();
    const Link link = BestLink({name + ".png"}, placed.empty() ? all : placed, evidence);
    (!known || image->second.keypoints == 0 ? blank
     : image->second.partners.empty()       ? lonely
     : link.matches == 0                    ? apart
     : link.matches < kEnoughWithOne        ? weak
                                            : odd)
        .push_back(name);
    if (link.matches < kEnoughWithOne) most_weak = std::max(most_weak, link.matches);
  }
  const auto add = [&](const std::string& words, const std::vector<std::string>& names,
                       const std::string& more = "") {
    if (!names.empty()) parts.push_back(words + " " + EnumerateRuns(names, views) + more);
  };
  const std::string inside = evidence.masked ? " inside of the masks" : "";
  add("no features" + inside + " in", blank);
  add("no match" + inside + " with any other view for", lonely);
  add("matches" + inside + " only with others that were not placed for", apart);
  add("too few matches" + inside + " for", weak, fmt::format(" (at most {} with one view)", most_weak));
  add("matches, but no place that fits them, for", odd);
  return fmt::format("{}", fmt::join(parts, "; "));
}

double FieldDeg(const Pinhole& lens) { return 2 * std::atan2(lens.width, 2 * lens.fx) * 180 / M_PI; }

// doubt: what to do about points that miss their features; cure: about a wrong focal length.
void JudgeCameras(const SparseModel& model, const std::string& doubt, const std::string& cure,
                  Progress& progress) {
  const double error = MeanError(model);
  if (error > kDoubtfulError)
    progress.Warn(
        fmt::format("the poses are doubtful: the points miss their features by {:.1f} px on average (good is "
                    "below 1). {}",
                    error, doubt));
  for (const auto& [id, camera] : model.cameras) {
    const Pinhole lens = ToLens(camera).pinhole;
    const double ratio = lens.fx / lens.fy, field_deg = FieldDeg(lens);
    const bool is_centred = lens.cx > 0 && lens.cx < lens.width && lens.cy > 0 && lens.cy < lens.height;
    if (ratio < 0.9 || ratio > 1.1 || field_deg < 2 || field_deg > 140 || !is_centred)
      progress.Warn(
          fmt::format("the camera is doubtful: focal lengths {:.0f} and {:.0f} px, field of view {:.0f} "
                      "degrees, principal point ({:.4g}, {:.4g}) of {} x {} px. {}",
                      lens.fx, lens.fy, field_deg, lens.cx, lens.cy, lens.width, lens.height, cure));
  }
}

// The largest distance of two cameras' centres.
double WidestBaseline(const SparseModel& model) {
  double largest = 0;
  for (const auto& [id, a] : model.images)
    for (const auto& [other, b] : model.images)
      if (id < other)
        largest = std::max(largest, (a.cam_from_world.Center() - b.cam_from_world.Center()).norm());
  return largest;
}

}  // namespace

std::vector<std::string> MissingViews(const SparseModel& model, const std::vector<ListedView>& views) {
  const std::set<std::string> posed = PicturesOf(model);
  std::vector<std::string> missing;
  for (const ListedView& view : views)
    if (!posed.contains(view.PictureName())) missing.push_back(view.name);
  return missing;
}

double RegisteredShare(const SparseModel& model, const std::vector<ListedView>& views) {
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

std::optional<double> Parallax(const SparseModel& model) {
  std::map<std::uint32_t, std::vector<double>> depths;
  for (const auto& [id, point] : model.points)
    for (const ColmapPoint::Track& track : point.track) {
      const auto image = model.images.find(track.image_id);
      if (image == model.images.end()) continue;
      const double depth = (image->second.cam_from_world * point.position).z();
      if (depth > 0) depths[track.image_id].push_back(depth);
    }
  std::optional<double> largest;
  const double extent = WidestBaseline(model);
  for (auto& [id, all] : depths) {
    const double focal = ToLens(model.cameras.at(model.images.at(id).camera_id)).pinhole.fx;
    largest = std::max(largest.value_or(0), focal * extent / Median(std::move(all)));
  }
  return largest;
}

bool HasMoved(const SparseModel& model) {
  return model.images.empty() || Parallax(model).value_or(0) > kLeastParallaxPx;
}

void CheckEstimatedPoses(const SparseModel& model, const std::vector<ListedView>& views,
                         const Evidence& evidence, double smallest_share, const std::string& log,
                         Progress& progress) {
  const std::vector<std::string> missing = MissingViews(model, views);
  const std::size_t registered = views.size() - missing.size();
  const double share = double(registered) / double(views.size());
  const std::string causes = Causes(missing, model, views, evidence);
  const char* cures = evidence.by_board           ? kBoardCures
                      : evidence.still_background ? kStillCures
                      : evidence.pieces.empty()   ? kCures
                                                  : kPieceCures;
  if (share < smallest_share || registered < 2)
    throw Error(fmt::format("only {} of {} views could be placed ({})", registered, views.size(), causes),
                log, cures);
  if (!HasMoved(model))
    throw Error(
        fmt::format("the cameras hardly moved against the depth of what they see: by {:.2g} px in the "
                    "picture ({} of {} views, {} points)",
                    Parallax(model).value_or(0), registered, views.size(), model.points.size()),
        log, kStillCures);
  if (share < kGoodShare)
    progress.Warn(
        fmt::format("only {} of {} views could be placed ({}). {}", registered, views.size(), causes, cures));
  else if (!missing.empty())
    progress.Warn(fmt::format("{} of {} views could not be placed and are left out: {}", missing.size(),
                              views.size(), causes));
  JudgeCameras(model, fmt::format("Try another camera model, or give the focal length ({})", log),
               "Try the camera model SIMPLE_RADIAL, or give the focal length", progress);
}

void CheckKnownPoses(const SparseModel& model, const std::string& where, bool adjusted, Progress& progress) {
  const std::string in_pixels =
      "Focal lengths and principal points are in pixels: the lens's mm / the sensor's width in mm * the "
      "picture's width";
  for (const auto& [id, camera] : model.cameras)
    if (const Pinhole lens = ToLens(camera).pinhole; FieldDeg(lens) > kWidestDeg)
      throw Error(
          fmt::format("camera {} has a focal length of {:.3g} px for a picture {} px wide: it would see "
                      "{:.0f} degrees",
                      id, lens.fx, lens.width, FieldDeg(lens)),
          where, in_pixels);
  double farthest = 0;
  for (const auto& [id, image] : model.images)
    farthest = std::max(farthest, (image.cam_from_world.Center() + model.offset).norm());
  if (WidestBaseline(model) <= 1e-12 * farthest)
    throw Error("all cameras of the known poses stand at one place", where,
                "Depth needs views from several places. Poses are cam_from_world: the translation is not the "
                "camera's place, but minus the rotation times it");
  if (const std::string other = OtherConvention(model); !other.empty())
    progress.Warn(fmt::format("{} ({})", other, where));
  JudgeCameras(model,
               adjusted ? fmt::format("They were adjusted and are not right yet: check them and the focal "
                                      "length, or let the pictures tell the poses ({})",
                                      where)
                        : fmt::format("Try --bundle-adjustment ({})", where),
               fmt::format("{} ({})", in_pixels, where), progress);
}

}  // namespace polarscan
